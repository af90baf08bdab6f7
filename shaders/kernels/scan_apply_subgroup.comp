#version 460
// Scan, third stage: the blocks after what lies before them. With subgroup operations.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require

layout(local_size_x_id = 0) in;

#define KERNEL_SUBGROUPS
#include "kernels/scan_apply.glsl"

void main() { scan_apply(); }
