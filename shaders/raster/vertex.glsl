// Vertices pulled from the scene's triangles by their number.
#ifndef CLERESTORY_RASTER_VERTEX_GLSL
#define CLERESTORY_RASTER_VERTEX_GLSL

#include "raster/project.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_view;
} push;

// Behind every view's near plane, so that the triangle is clipped away.
const float RASTER_NOWHERE = -1.0;

// Weights of a triangle's corners 1 and 2 at one of its corners.
vec2 raster_corner_weights(uint corner) { return vec2(corner == 1u ? 1.0 : 0.0, corner == 2u ? 1.0 : 0.0); }

#endif
