#version 460
// Cuts of triangles along the planes of octants, and pieces of triangles, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#include "raster/octants.glsl"
#include "raster/tessellation.glsl"

OctantPolygon triangle() {
    OctantPolygon whole;
    whole.count = 3;
    whole.corners[0] = OctantCorner(in3(0u), vec2(0.0));
    whole.corners[1] = OctantCorner(in3(3u), vec2(1.0, 0.0));
    whole.corners[2] = OctantCorner(in3(6u), vec2(0.0, 1.0));
    return whole;
}

// The number of corners, and sums over them in the order of their strip.
void out_polygon(uint i, OctantPolygon polygon) {
    vec3 p = vec3(0.0);
    vec2 weights = vec2(0.0);
    for (int place = 0; place < polygon.count; ++place) {
        OctantCorner corner = polygon.corners[octant_strip_corner(place, polygon.count)];
        p += float(place + 1) * corner.p;
        weights += float(place + 1) * corner.weights;
    }
    out_bits(i, uint(polygon.count));
    out3(i + 1u, p);
    out2(i + 4u, weights);
}

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // the piece of an octant
        uint octant = in_bits(9u);
        OctantPolygon piece = triangle();
        for (int axis = 0; axis < 3; ++axis) {
            piece = octant_half(piece, axis, (octant >> axis & 1u) == 1u);
        }
        out_polygon(0u, piece);
        out_bits(6u, octant_of(in3(0u)));
        break;
    }
    case 1u: {  // the outline of a half
        out_polygon(0u, octant_outline(octant_half(triangle(), 2, in_bits(9u) == 1u)));
        break;
    }
    case 2u: {  // pieces of triangles
        uvec3 weights = tessellation_weights(in_bits(9u), in_bits(10u), in_bits(11u));
        out3(0u, vec3(weights));
        out3(3u, tessellation_point(weights, in_bits(9u), in3(0u), in3(3u), in3(6u)));
        break;
    }
    }
}
