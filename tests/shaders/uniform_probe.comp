#version 460
// Adds a uniform to every word: a kernel that reads a uniform buffer, which wants barriers of its own.
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8) in;

layout(set = 0, binding = 0) uniform Addend { uint addend; };
layout(set = 0, binding = 1, scalar) restrict buffer Words { uint words[]; };

void main() { words[gl_GlobalInvocationID.x] += addend; }
