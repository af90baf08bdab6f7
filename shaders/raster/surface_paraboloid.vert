#version 460
// Pieces of the scene's triangles whose corners are mapped to one half of the dual paraboloid map and joined by straight edges, cut where the
// other half begins.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const int LEVEL = 1;

#include "raster/piece_main.glsl"

void main() {
    uint level = uint(LEVEL);
    raster_view = push.first_view;
    SceneTriangle t;
    bool is_somewhere = piece_triangle(level, t);
    uint corner = piece_own_corner();
    RasterView view = raster_views[raster_view];
    vec3 p = raster_relative(view, piece_corner(level, corner, t));
    raster_weights = piece_weights(level, corner);
    float along = view.signs.z * p.z;
    // The map of a direction d is d.xy / (1 + d.z), times the distance above and below.
    gl_Position = is_somewhere ? vec4(p.xy, view.z.w, length(p) + along) : vec4(0.0, 0.0, RASTER_NOWHERE, 1.0);
    gl_ClipDistance[0] = along;
}
