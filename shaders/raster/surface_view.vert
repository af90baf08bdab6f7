#version 460
// The scene's triangles in several views at once, each a layer.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_multiview : require

#include "raster/weighted_vertex.glsl"

void main() { raster_weighted_vertex(uint(gl_ViewIndex)); }
