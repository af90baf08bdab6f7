#version 460
// The scene's triangles in several views, an instance for each, all in one picture.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster/weighted_vertex.glsl"

void main() { raster_weighted_vertex(uint(gl_InstanceIndex)); }
