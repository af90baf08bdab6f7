// The vertex stage of vertex_main.glsl with weights of the corners, for fragments whose attributes the rasterizer interpolates.
#ifndef CLERESTORY_RASTER_WEIGHTED_VERTEX_GLSL
#define CLERESTORY_RASTER_WEIGHTED_VERTEX_GLSL

#include "raster/vertex_main.glsl"

layout(location = 2) out vec2 raster_weights;

// Returns the vertex from the view's origin.
vec3 raster_weighted_vertex(uint number) {
    raster_weights = raster_corner_weights(uint(gl_VertexIndex) % 3u);
    return raster_vertex(number);
}

#endif
