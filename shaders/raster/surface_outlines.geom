#version 460
// Triangles cut along z = 0, with corners where their outlines cross x = 0 and y = 0: outlines are those of the rectangular octahedron map,
// and the inside is what a strip between them makes of it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(triangles) in;
layout(triangle_strip, max_vertices = 15) out;

#include "raster/cut_main.glsl"

void main() {
    OctantPolygon whole = cut_triangle();
    for (uint z = 0u; z < 2u; ++z) {
        cut_emit(octant_outline(octant_half(whole, 2, z == 1u)), z << 2, 4u);
    }
}
