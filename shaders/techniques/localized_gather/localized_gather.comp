#version 460
// Indirect light where eye paths first arrive at rough surfaces, from the lights that a coarse map's texels stand for: one place an invocation. What cosine-shaped lobes
// reflect is their albedo times a lobe of exponent 1 about the normal, what microfacets do is theirs times a narrower one about the mirrored direction, of lights before the
// surface alone, scaled to the whole lobe: all of them, or the few that count most.
//
// Sources, bias and guarantees: techniques/localized_gather/mod.rs; maps/gather/mod.rs. Deterministic: sums in the order of lights, in blocks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

float gather_table_value(uint i);

#include "transport/features.glsl"
#include "walk/wave.glsl"
#include "maps/gather.glsl"
#include "maps/gather_few.glsl"
#include "transport/arrival.glsl"
#include "transport/microfacet_albedo.glsl"

// Exponents of the lobes that stand for microfacets, at most: narrower ones fall between lights.
const float GLOSSY_EXPONENT_MAX = 64.0;

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint first_triangle;  // of what gathers
    vec3 scene_upper;
    uint end_triangle;
    vec3 place;           // of the map
    uint lights;
} push;

layout(set = 1, binding = 0, scalar) restrict readonly buffer GatherLights { GatherRecord gather_lights[]; };
layout(set = 1, binding = 1, scalar) restrict readonly buffer GatherTable { float gather_table[]; };  // of exponent 1
layout(set = 1, binding = 2, scalar) restrict buffer LocalizedCounters { uint gathers; } localized_counters;

// Stands in walk_resume for a place that has gathered.
const uint LOCALIZED_DONE = 0xFFFFFFFCu;

float gather_table_value(uint i) { return gather_table[i]; }

// Exponent of the cosine lobe about the mirrored direction that is as narrow at its middle as a GGX lobe of width alpha: a quarter of 2 / alpha^2 - 2, which is that
// about the half vector.
float glossy_exponent(float alpha) { return clamp(0.5 / (alpha * alpha) - 0.5, 1.0, GLOSSY_EXPONENT_MAX); }

void gather_at(uint slot, uint place) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    if (path.bounce != 0u || hit.triangle == NO_HIT || hit.triangle < push.first_triangle || hit.triangle >= push.end_triangle) {
        return;
    }
    Arrival a = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(a) || !arrival_has_rough_lobes(a)) {
        return;
    }
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    float cos_o = abs(frame.wo.z);
    vec3 cosine = cosine_lobes(a.bsdf, cos_o, false, LOBE_REFLECTION).seen;
    vec3 shine = vec3(0.0);
    if ((HAS_METAL || HAS_SPECULAR_LAYER) && !bsdf_is_delta(a.bsdf)) {
        shine = microfacet_albedo(a.bsdf, cos_o);
    }
    vec3 mirrored_way = 2.0 * frame.wo.z * frame.z - a.wo;
    float exponent = glossy_exponent(a.bsdf.alpha);
    bool is_shiny = shine != vec3(0.0);
    vec3 x = a.surface.point.position - push.place;
    vec3 sum = vec3(0.0);
    // Light of the narrower lobe; its weight of all lights and of those before the surface.
    vec3 shining = vec3(0.0);
    vec2 weights = vec2(0.0);
    GatherFew few = gather_no_terms();
    for (uint first = 0u; first < push.lights; first += GATHER_BLOCK) {
        vec3 block = vec3(0.0);
        vec3 shining_block = vec3(0.0);
        vec2 weights_block = vec2(0.0);
        for (uint k = first; k < min(first + GATHER_BLOCK, push.lights); ++k) {
            GatherRecord light = gather_lights[k];
            block += cosine * gather_term(light, x, frame.z, 1.0, GATHER_CONES) * light.radiance;
            if (is_shiny) {
                float weight = gather_term(light, x, mirrored_way, exponent, false);
                float before = dot(frame.z, light.position - x) > 0.0 ? weight : 0.0;
                if (GATHER_FIVE) {
                    gather_add(few, vec4(light.radiance, before));
                }
                shining_block += before * light.radiance;
                weights_block += vec2(weight, before);
            }
        }
        sum += block;
        shining += shining_block;
        weights += weights_block;
    }
    if (GATHER_FIVE) {
        vec4 of_few = gather_sum(few);
        shining = of_few.rgb;
        weights.y = of_few.w;
    }
    if (weights.y > 0.0) {
        sum += shine * shining * (weights.x / weights.y);
    }
    walk_gathered[slot].radiance += path.throughput * sum;
    atomicAdd(localized_counters.gathers, 1u);
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    if (walk_resume[place] == LOCALIZED_DONE) {
        return;
    }
    if (!has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = LOCALIZED_DONE;
    gather_at(load_slot(place), place);
    count_work(status.rounds == 0u ? push.lights : 0u, WORK_UNIT);
}
