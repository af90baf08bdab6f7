#version 460
// Scan, third stage: the blocks after what lies before them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/scan_apply.glsl"

void main() { scan_apply(); }
