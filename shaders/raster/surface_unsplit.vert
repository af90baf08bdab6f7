#version 460
// Pieces of the scene's triangles whose corners are mapped to the octahedron map and joined by straight edges; those that lie over one of
// the map's seams are left out.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const int LEVEL = 1;

#include "raster/octants.glsl"
#include "raster/piece_main.glsl"

// Of a quotient of clip coordinates that should be equal on both sides: beyond the rounding of a dozen operations, below a texel.
const float SEAM_WIDTH = 1.0 / 131072.0;

// Whether the map is torn where an edge crosses a plane: its image is in two places.
bool edge_is_torn(vec3 a, vec3 b) {
    for (int axis = 0; axis < 3; ++axis) {
        if (a[axis] < 0.0 == b[axis] < 0.0) {
            continue;
        }
        vec3 p = octant_crossing(OctantCorner(a, vec2(0.0)), OctantCorner(b, vec2(0.0)), axis).p;
        uint above = octant_of(p);
        vec4 one = raster_project(raster_views[push.first_view + above], p);
        vec4 other = raster_project(raster_views[push.first_view + (above | 1u << axis)], p);
        vec2 apart = abs(one.xy - other.xy);
        if (max(apart.x, apart.y) > SEAM_WIDTH * one.w) {
            return true;
        }
    }
    return false;
}

void main() {
    uint level = uint(LEVEL);
    raster_view = push.first_view;
    SceneTriangle t;
    bool is_somewhere = piece_triangle(level, t);
    RasterView view = raster_views[raster_view];
    vec3 corners[3];
    for (uint corner = 0u; corner < 3u; ++corner) {
        corners[corner] = raster_relative(view, piece_corner(level, corner, t));
    }
    raster_weights = piece_weights(level, piece_own_corner());
    vec3 p = corners[piece_own_corner()];
    bool is_torn = edge_is_torn(corners[0], corners[1]) || edge_is_torn(corners[1], corners[2])
        || edge_is_torn(corners[2], corners[0]);
    gl_Position = is_somewhere && !is_torn ? raster_project(raster_views[push.first_view + octant_of(p)], p)
                                           : vec4(0.0, 0.0, RASTER_NOWHERE, 1.0);
}
