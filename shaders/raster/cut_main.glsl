// Geometry shaders that cut triangles for the octahedron map: what they take, and strips of polygons.
#ifndef CLERESTORY_RASTER_CUT_MAIN_GLSL
#define CLERESTORY_RASTER_CUT_MAIN_GLSL

#include "raster/octants.glsl"
#include "raster/vertex.glsl"

layout(location = 0) flat in uint triangle_in[];
layout(location = 1) in vec3 place_in[];
layout(location = 2) flat in uint there_in[];

layout(location = 0) flat out uint raster_triangle;
layout(location = 1) flat out uint raster_view;
layout(location = 2) out vec2 raster_weights;

// Without corners where rays cannot meet the triangle.
OctantPolygon cut_triangle() {
    OctantPolygon whole;
    whole.count = there_in[0] == 0u ? 0 : 3;
    for (int corner = 0; corner < 3; ++corner) {
        whole.corners[corner] = OctantCorner(place_in[corner], raster_corner_weights(uint(corner)));
    }
    return whole;
}

// A strip over a polygon, each corner in the octant that it has there: `octants` gives the signs that all share, by the bits of `shared`.
void cut_emit(OctantPolygon polygon, uint octants, uint shared_bits) {
    if (polygon.count < 3) {
        return;
    }
    for (int place = 0; place < polygon.count; ++place) {
        OctantCorner corner = polygon.corners[octant_strip_corner(place, polygon.count)];
        uint octant = (octants & shared_bits) | (octant_of(corner.p) & ~shared_bits);
        gl_Position = raster_project(raster_views[push.first_view + octant], corner.p);
        raster_triangle = triangle_in[0];
        raster_view = push.first_view + octant;
        raster_weights = corner.weights;
        EmitVertex();
    }
    EndPrimitive();
}

#endif
