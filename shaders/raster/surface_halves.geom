#version 460
// Triangles cut along z = 0, each half of the sphere being one square of the rectangular octahedron map. What crosses x = 0 or y = 0 stays
// straight, though its image has a bend there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(triangles) in;
layout(triangle_strip, max_vertices = 7) out;

#include "raster/cut_main.glsl"

void main() {
    OctantPolygon whole = cut_triangle();
    for (uint z = 0u; z < 2u; ++z) {
        cut_emit(octant_half(whole, 2, z == 1u), z << 2, 4u);
    }
}
