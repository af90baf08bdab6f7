// Whether each ray of a buffer meets anything; the hit written for one that does is any of its hits.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define TRACE any_hit
#include "accel/trace.glsl"
