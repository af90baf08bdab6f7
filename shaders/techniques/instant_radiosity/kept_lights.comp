#version 460
// Records of kept virtual lights: of what their directions have met, with the power that now arrives there. Those that are absent, that have left the scene or that lie on a mirror
// have no power.
//
// SVO-G2: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", 2007. Deterministic.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "invocation.glsl"
#include "accel/index_rays.glsl"
#include "finite.glsl"
#include "techniques/instant_radiosity/kept.glsl"
#include "techniques/instant_radiosity/new_virtual_light.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint lights;
    vec3 scene_upper;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer KeptLights { KeptLight kept_lights[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer KeptHits { KeptHit kept_hits[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer VirtualLightRecords { uvec4 virtual_light_records[]; };

void main() {
    uint number = invocation_index();
    if (number >= push.lights) {
        return;
    }
    KeptLight kept = kept_lights[number];
    VirtualLight light = VirtualLight(kept.lamp + kept.direction, 0u, -kept.direction, 0.0, vec3(0.0), kept.direction, vec3(0.0), 0u);
    uint triangle = kept.asks != KEPT_ABSENT ? kept_hits[number].triangle : NO_HIT;
    if (triangle != NO_HIT) {
        vec2 weights = kept_hits[number].weights;
        Arrival a = arrival_at(Hit(0.0, weights, triangle), kept.direction, push.scene_lower, push.scene_upper);
        vec3 power = absorbed(kept.power, arrival_interior(a, OUTSIDE), distance(kept.lamp, a.surface.point.position));
        power = arrival_has_rough_lobes(a) ? finite_or_black(power) : vec3(0.0);
        light = new_virtual_light(a, triangle, weights, power, kept.direction, 0u);
    }
    uvec4 quarters[VIRTUAL_LIGHT_QUARTERS];
    pack_virtual_light(light, quarters);
    for (uint i = 0u; i < VIRTUAL_LIGHT_QUARTERS; ++i) {
        virtual_light_records[VIRTUAL_LIGHT_QUARTERS * number + i] = quarters[i];
    }
}
