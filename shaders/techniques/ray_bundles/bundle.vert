#version 460
// The scene's triangles along the lines of a bundle.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster/vertex_main.glsl"

// Both drawings have the same fragments.
invariant gl_Position;

void main() { raster_vertex(0u); }
