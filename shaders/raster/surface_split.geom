#version 460
// Triangles cut along the three planes of the octahedron map: every piece in the view of its octant.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(triangles) in;
layout(triangle_strip, max_vertices = 31) out;

#include "raster/cut_main.glsl"

void main() {
    OctantPolygon whole = cut_triangle();
    for (uint x = 0u; x < 2u; ++x) {
        OctantPolygon half_polygon = octant_half(whole, 0, x == 1u);
        if (half_polygon.count < 3) {
            continue;
        }
        for (uint y = 0u; y < 2u; ++y) {
            OctantPolygon quarter = octant_half(half_polygon, 1, y == 1u);
            if (quarter.count < 3) {
                continue;
            }
            for (uint z = 0u; z < 2u; ++z) {
                cut_emit(octant_half(quarter, 2, z == 1u), x | y << 1 | z << 2, 7u);
            }
        }
    }
}
