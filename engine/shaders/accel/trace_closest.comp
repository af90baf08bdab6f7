// Closest hits of a buffer of rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define TRACE closest_hit
#include "accel/trace.glsl"
