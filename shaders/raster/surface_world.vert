#version 460
// The scene's triangles as they are, for a geometry shader that takes them to several views.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster/vertex.glsl"

layout(location = 0) flat out uint raster_triangle;
layout(location = 1) out vec3 raster_place;      // from the origin of the views, which is one for all
layout(location = 2) flat out uint raster_there;

void main() {
    raster_triangle = uint(gl_VertexIndex) / 3u;
    vec3 p;
    raster_there = uint(raster_corner(raster_views[push.first_view], raster_triangle, uint(gl_VertexIndex) % 3u, p));
    raster_place = p;
}
