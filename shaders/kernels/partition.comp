#version 460
// Compaction and split, last stage: elements to their places.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/partition.glsl"

void main() { partition_blocks(); }
