#version 460
// Light subpaths leave the lights: one slot each, with the partial weights that bdpt_mis.glsl goes on from.
//
// Veach 1997, 10; I. Georgiev, "Implementing Vertex Connection and Merging", 2012; emission: transport/emission.glsl. Deterministic in (seed, pass, walk).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "walk/wave.glsl"
#include "transport/emission.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    float radius;  // of the scene's bounding sphere
    vec3 scene_upper;
    WalkKey key;   // the sequence is the pass, places in it walks
} push;

#include "walk/draws.glsl"

PartialWeights emitted_weights(Emission e) {
    if (e.infinite) {
        float pdf = e.direction_pdf * e.probability;
        return PartialWeights(e.area, pdf > 0.0 ? e.area / pdf : 0.0);
    }
    if (e.area > 0.0) {
        // Over the densities of the direction, and of the place and the direction per projected solid angle.
        float pdf = e.side * max(e.direction_pdf, cosine_hemisphere_pdf(MIS_COS_MIN));
        return PartialWeights(1.0 / pdf, PI * e.area / e.probability);
    }
    return PartialWeights(e.direction_pdf > 0.0 ? 1.0 / e.direction_pdf : 0.0, 0.0);
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.key.indices) {
        return;
    }
    uvec2 point = sampler_bits(walk_sampler(slot, DIMENSION_START_POINT));
    Emission e = emit(point, sampler_bits(walk_sampler(slot, DIMENSION_START_DIRECTION)), push.scene_lower, push.scene_upper, push.radius);
    // Walks from the lights have no use for a density: whether they come from infinity stands there.
    walk_states_out[slot] = WalkState(e.origin, states_of_walk(accepting_states()), normalize(e.direction), 0u, e.power, e.infinite ? 1.0 : 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), e.interior);
    subpath_weights[slot] = mis_bounded(emitted_weights(e));
}
