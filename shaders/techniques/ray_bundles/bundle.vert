#version 460
// The scene's triangles along the lines of a bundle.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Both drawings have the same fragments.
invariant gl_Position;

#include "raster/vertex_main.glsl"

void main() { raster_vertex(0u); }
