#version 460
// Compaction and split, last stage: elements to their places. With subgroup operations.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require

layout(local_size_x_id = 0) in;

#define KERNEL_SUBGROUPS
#include "kernels/partition.glsl"

void main() { partition_blocks(); }
