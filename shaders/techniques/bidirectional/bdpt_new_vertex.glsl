// How walks from the lights leave vertices: they wait by place, and bdpt_append.comp takes them up. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_NEW_VERTEX_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_NEW_VERTEX_GLSL

#include "techniques/bidirectional/bdpt_vertex.glsl"
#include "walk/wave.glsl"

// Lets a vertex wait at a place: on a surface, by barycentric coordinates and triangle, or with a medium at a position.
void store_light_vertex(uint place, uvec3 at, uint medium, uint history, WalkState walk, PartialWeights weights) {
    uvec3 way = floatBitsToUint(walk.direction);
    if (HAS_MEDIA) {
        way = uvec3(floatBitsToUint(octahedron_encode(walk.direction)), medium == NO_MEDIUM ? 0u : medium + 1u);
    }
    store_waiting(place, uvec4(at, history), floatBitsToUint(vec4(walk.throughput, weights.d_vcm)), uvec4(way, floatBitsToUint(weights.d_vc)));
}

#endif
