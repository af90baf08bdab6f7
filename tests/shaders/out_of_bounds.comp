#version 460
// Writes one word where it is told to, inside the buffer or not: the planted error of the layers' test.
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 1) in;

layout(push_constant, scalar) uniform Push {
    uint index;
    uint value;
};

layout(set = 0, binding = 0, scalar) writeonly buffer Words {
    uint words[];
};

void main() {
    words[index] = value;
}
