#version 460
// Wavefront path tracer: the closest hit of every path's ray, for scenes with participating media.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define PATH_MEDIA
#include "transport/path_extend.glsl"
