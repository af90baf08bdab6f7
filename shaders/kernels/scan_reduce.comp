#version 460
// Scan, first stage: totals of the teams' blocks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/scan_reduce.glsl"

void main() { scan_reduce(); }
