// The vertex stage where triangles are drawn as pieces: three vertices per piece, level² pieces per triangle.
#ifndef CLERESTORY_RASTER_PIECE_MAIN_GLSL
#define CLERESTORY_RASTER_PIECE_MAIN_GLSL

#include "raster/tessellation.glsl"
#include "raster/vertex.glsl"

layout(location = 0) flat out uint raster_triangle;
layout(location = 1) flat out uint raster_view;
layout(location = 2) out vec2 raster_weights;

uint piece_own_corner() { return uint(gl_VertexIndex) % 3u; }

// The triangle that the piece is of; false when rays cannot meet it.
bool piece_triangle(uint level, out SceneTriangle t) {
    raster_triangle = uint(gl_VertexIndex) / (3u * level * level);
    t = load_triangle(raster_triangle);
    return raster_is_traceable(t.a) && raster_is_traceable(t.b) && raster_is_traceable(t.c);
}

uvec3 piece_corner_weights(uint level, uint corner) {
    return tessellation_weights(level, uint(gl_VertexIndex) / 3u % (level * level), corner);
}

vec3 piece_corner(uint level, uint corner, SceneTriangle t) {
    return tessellation_point(piece_corner_weights(level, corner), level, t.a, t.b, t.c);
}

vec2 piece_weights(uint level, uint corner) {
    return vec2(piece_corner_weights(level, corner).yz) / float(level);
}

#endif
