// What each ray of a buffer meets first, or whether it meets anything.
// variant: driver
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/trace.glsl"
