#version 460
// Triangles to several views with one origin, a layer for each; those that lie on the outer side of one of a view's planes are left out.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const int VIEWS = 6;

layout(triangles) in;
layout(triangle_strip, max_vertices = 18) out;

#include "raster/vertex.glsl"

layout(location = 0) flat in uint triangle_in[];
layout(location = 1) in vec3 place_in[];
layout(location = 2) flat in uint there_in[];

layout(location = 0) flat out uint raster_triangle;
layout(location = 1) flat out uint raster_view;
layout(location = 2) out vec2 raster_weights;

bool all_outside(vec3 coordinate, vec3 w) {
    return all(greaterThan(coordinate, w)) || all(lessThan(coordinate, -w));
}

void main() {
    if (there_in[0] == 0u) {
        return;
    }
    for (int number = 0; number < VIEWS; ++number) {
        RasterView view = raster_views[push.first_view + number];
        vec4 corners[3];
        for (int corner = 0; corner < 3; ++corner) {
            corners[corner] = raster_project(view, place_in[corner]);
        }
        vec3 w = vec3(corners[0].w, corners[1].w, corners[2].w);
        if (all_outside(vec3(corners[0].x, corners[1].x, corners[2].x), w)
            || all_outside(vec3(corners[0].y, corners[1].y, corners[2].y), w)) {
            continue;
        }
        for (int corner = 0; corner < 3; ++corner) {
            gl_Position = corners[corner];
            gl_Layer = number;
            raster_triangle = triangle_in[0];
            raster_view = push.first_view + number;
            raster_weights = raster_corner_weights(uint(corner));
            EmitVertex();
        }
        EndPrimitive();
    }
}
