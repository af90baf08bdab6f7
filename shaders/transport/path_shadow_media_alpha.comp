#version 460
// Wavefront path tracer: shadow rays, for scenes with participating media and alpha.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define PATH_ALPHA
#define PATH_MEDIA
#include "transport/path_shadow_media.glsl"
