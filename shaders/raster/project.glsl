// Places of the scene's vertices in a view, from its origin.
//
// The same vertex gives the same bits in every triangle and in every way of rendering: `precise` keeps compilers from contracting it
// differently.
#ifndef CLERESTORY_RASTER_PROJECT_GLSL
#define CLERESTORY_RASTER_PROJECT_GLSL

#include "raster/bindings.glsl"
#include "accel/ray.glsl"

bool raster_is_traceable(vec3 p) { return all(lessThanEqual(abs(p), vec3(MAX_COORDINATE))); }

vec3 raster_relative(RasterView view, vec3 p) {
    precise vec3 relative = p - view.origin;
    return relative;
}

float raster_row(vec4 row, vec3 p) {
    precise float value = row.x * p.x + row.y * p.y + row.z * p.z + row.w;
    return value;
}

// Clip coordinates of a point that is given from the view's origin.
vec4 raster_project(RasterView view, vec3 p) {
    return vec4(raster_row(view.x, p), raster_row(view.y, p), raster_row(view.z, p), raster_row(view.w, p));
}

// Corner of a triangle from the view's origin. Triangles that rays cannot meet, since a coordinate is NaN, infinite or out of range, are
// nowhere.
bool raster_corner(RasterView view, uint triangle, uint corner, out vec3 p) {
    SceneTriangle t = load_triangle(triangle);
    p = raster_relative(view, corner == 0u ? t.a : corner == 1u ? t.b : t.c);
    return raster_is_traceable(t.a) && raster_is_traceable(t.b) && raster_is_traceable(t.c);
}

#endif
