// The vertex stage where the view is known in it: three vertices per triangle, by number.
#ifndef CLERESTORY_RASTER_VERTEX_MAIN_GLSL
#define CLERESTORY_RASTER_VERTEX_MAIN_GLSL

#include "raster/vertex.glsl"

layout(location = 0) flat out uint raster_triangle;
layout(location = 1) flat out uint raster_view;

// Returns the vertex from the view's origin.
vec3 raster_vertex(uint number) {
    raster_view = push.first_view + number;
    raster_triangle = uint(gl_VertexIndex) / 3u;
    RasterView view = raster_views[raster_view];
    uint corner = uint(gl_VertexIndex) % 3u;
    vec3 p;
    bool is_somewhere = raster_corner(view, raster_triangle, corner, p);
    gl_Position = is_somewhere ? raster_project(view, p) : vec4(0.0, 0.0, RASTER_NOWHERE, 1.0);
    return p;
}

#endif
