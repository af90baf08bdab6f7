// Vertices that walks from the lights leave, in LIGHT_VERTEX_QUARTERS quarters:
// - on a surface barycentric coordinates and triangle, at a collision with a medium the place; and the history: scatterings before, group of its walk and, of path sets with an
//   automaton, its states (bdpt_states.glsl);
// - power that arrives, at a collision that is scattered, W, as if its walk were the only one, and d_vcm;
// - the way it came, unit, and d_vc. In scenes with media it stands in two words by the octahedron map, and behind them one more than the medium's index, or 0 on a surface.
//
// Walks of a pass are in as many groups as pixels have samples in it: what those of a group show the camera belongs to one sample of each pixel.
// Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_VERTEX_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_VERTEX_GLSL

#include "maps/octahedron.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"
#include "transport/bodies.glsl"

// Where a walk's group lies in its history.
const uint LIGHT_GROUP_SHIFT = 16u;
// The same where states are there, too, and where these lie.
const uint LIGHT_STATES_GROUP_SHIFT = 13u;
const uint LIGHT_STATES_SHIFT = 17u;

struct LightVertex {
    vec2 barycentrics;
    uint triangle;
    uint group;
    uint bounce;
    uint states;
    vec3 power;
    vec3 direction;
    PartialWeights weights;
    vec3 position;  // of a collision
    uint medium;    // of a collision, or NO_MEDIUM
};

uint pack_history(uint bounce, uint group, uint states) {
    if (HAS_PATH_AUTOMATON) {
        return bounce | group << LIGHT_STATES_GROUP_SHIFT | states << LIGHT_STATES_SHIFT;
    }
    return bounce | group << LIGHT_GROUP_SHIFT;
}

LightVertex load_light_vertex(uint index) {
    int first = int(LIGHT_VERTEX_QUARTERS * index);
    uvec4 q0 = texelFetch(light_vertex_texels, first);
    vec4 q1 = uintBitsToFloat(texelFetch(light_vertex_texels, first + 1));
    uvec4 q2 = texelFetch(light_vertex_texels, first + 2);
    LightVertex v;
    v.barycentrics = uintBitsToFloat(q0.xy);
    v.triangle = q0.z;
    uint shift = HAS_PATH_AUTOMATON ? LIGHT_STATES_GROUP_SHIFT : LIGHT_GROUP_SHIFT;
    v.bounce = q0.w & ((1u << shift) - 1u);
    v.group = q0.w >> shift;
    v.states = 1u;
    if (HAS_PATH_AUTOMATON) {
        v.group &= (1u << (LIGHT_STATES_SHIFT - LIGHT_STATES_GROUP_SHIFT)) - 1u;
        v.states = q0.w >> LIGHT_STATES_SHIFT;
    }
    v.power = q1.xyz;
    v.direction = uintBitsToFloat(q2.xyz);
    v.weights = PartialWeights(q1.w, uintBitsToFloat(q2.w));
    v.position = uintBitsToFloat(q0.xyz);
    v.medium = NO_MEDIUM;
    if (HAS_MEDIA) {
        v.direction = octahedron_decode(uintBitsToFloat(q2.xy));
        v.medium = q2.z - 1u;
    }
    return v;
}

#endif
