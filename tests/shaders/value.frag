#version 460
// A number for each covered pixel.

layout(location = 0) flat in uint written;
layout(location = 0) out uint result;

void main() {
    result = written;
}
