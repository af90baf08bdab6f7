// A rectangle of two triangles at a depth, and the number that is written where it covers.
#ifndef CLERESTORY_TESTS_RASTER_PUSH_GLSL
#define CLERESTORY_TESTS_RASTER_PUSH_GLSL

layout(push_constant, scalar) uniform Push {
    vec2 low;
    vec2 high;
    float depth;
    uint value;
};

vec4 raster_corner() { return vec4(mix(low, high, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1)), depth, 1.0); }

#endif
