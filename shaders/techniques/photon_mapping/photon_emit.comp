#version 460
// Photons leave the lights: one slot each, with the footprints of their light.
//
// PM-PD-1: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §5.1.1; emission: transport/emission.glsl.
// Deterministic in (seed, pass, photon).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"
#include "transport/emission.glsl"
#include "transport/path_set.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    float radius;  // of the scene's bounding sphere
    vec3 scene_upper;
    WalkKey key;   // the sequence is the pass, places in it photons
    uint photons;  // of the pass
    float share;   // of them that lights send
    float weight;  // of these, the reciprocal
    float placeless2;  // carried by photons from infinity, m2 (transport/photon_share.glsl); 0 where they carry none
} push;

#include "walk/draws.glsl"

// The footprint of light that leaves a light.
Differentials emitted_differentials(Emission e) {
    if (e.infinite) {
        return parallel_beam_differentials(e.direction, 1.0 / e.area);
    }
    if (e.area > 0.0) {
        return area_light_differentials(e.direction, e.direction_pdf, 1.0 / e.area, 2.0 * PI);
    }
    if (e.direction_pdf > 0.0) {
        return emission_differentials(e.direction, e.direction_pdf);
    }
    return Differentials(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
}

// The photon's number among those of its pass that are evenly spread, all by the same offset.
float even_survival(uint slot) {
    uint offset = pcg4d(uvec4(walk_sequence(slot), push.photons, SEQUENCE_KEY, push.key.seed)).x;
    return (float(walk_index(slot)) + unit_float(offset)) / float(push.photons);
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.key.indices) {
        return;
    }
    uvec2 point = sampler_bits(walk_sampler(slot, DIMENSION_START_POINT));
    Emission e = emit(point, sampler_bits(walk_sampler(slot, DIMENSION_START_DIRECTION)), push.scene_lower, push.scene_upper, push.radius);
    uint bounce = path_set_joined(0u, PHOTON_UNDIFFUSED);
    float survival = EVEN_SURVIVAL ? even_survival(slot) : 1.0;
    walk_states_out[slot] = WalkState(e.origin, survival, normalize(e.direction), bounce, e.power * push.weight, e.infinite ? push.placeless2 : 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), e.interior);
    if (HAS_DIFFERENTIALS) {
        // Only so many photons are of this light.
        photon_differentials[slot] = roulette_differentials(emitted_differentials(e), push.share * e.probability);
    }
}
