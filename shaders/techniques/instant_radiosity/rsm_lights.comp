#version 460
// Virtual lights from reflective shadow maps: points of a low-discrepancy sequence in the unit square, shifted as a whole each frame, come to views and texels in
// proportion to the luminance that those reflect: views lie side by side along the first coordinate, whose place in the share of its view goes on through the pyramid of
// that view's sums. Each light has as much of it.
//
// SVO-P9: P. Clarberg, W. Jarosz, T. Akenine-Moeller and H. W. Jensen, "Wavelet Importance Sampling", 2005 (hierarchical warping). Deterministic in (seed, frame, light).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 64) in;

layout(constant_id = 40) const uint RSM_SEQUENCE = 0u;  // RSM_HALTON, RSM_HAMMERSLEY or RSM_RANDOM

#include "transport/features.glsl"
#include "invocation.glsl"
#include "raster/atlas_level.glsl"
#include "raster/reflective.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/new_virtual_light.glsl"
#include "techniques/instant_radiosity/rsm.glsl"
#include "transport/random.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint lights;
    vec3 scene_upper;
    uint views;
    AtlasLevel top;  // of the pyramids, one texel a view
    uint capacity;   // views that there is room for
    uint side;
    uint frame;
    uint seed;
    uint subsets;    // of the lights, that pixels gather by themselves
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer RsmEmitters { RsmEmitter rsm_emitters[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer RsmTexels { RsmTexel rsm_texels[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer FluxSums { float flux_sums[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer RsmViews { RsmView rsm_views[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer VirtualLightRecords { uvec4 virtual_light_records[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer RsmTotal { float rsm_total; };  // luminance that all views reflect, W

vec2 unit_floats(uvec2 words) { return vec2(unit_float(words.x), unit_float(words.y)); }

// Of a light in the unit square.
vec2 sequence_point(uint number) {
    if (RSM_SEQUENCE == RSM_RANDOM) {
        return unit_floats(pcg4d(uvec4(number, push.frame, SEQUENCE_KEY, push.seed)).xy);
    }
    vec2 point;
    uint subset = 0u;
    if (RSM_SEQUENCE == RSM_HALTON) {
        // Consecutive points are spread evenly, so that those of a subset are.
        point = vec2(rsm_radical_inverse(number, 2u), rsm_radical_inverse(number, 3u));
    } else {
        // Consecutive points lie in a stripe: each subset has a set of its own.
        subset = interleave_subset(number, push.subsets, push.lights);
        uvec2 lights = interleave_lights(subset, push.subsets, push.lights);
        uint within = number - lights.x;
        point = vec2((float(within) + 0.5) / float(lights.y - lights.x), rsm_radical_inverse(within, 2u));
    }
    vec2 shift = unit_floats(pcg4d(uvec4(JOINT_KEY + subset, push.frame, SEQUENCE_KEY, push.seed)).xy);
    return min(fract(point + shift), vec2(RSM_BELOW_ONE));
}

// The view in whose share of all luminance a number lies, never one without any; the number becomes its place within that share.
uint choose_view(inout float number, float total) {
    float left = number * total;
    float within = 0.0;
    uint chosen = 0u;
    uint view = 0u;
    bool found = false;
    do {
        float share = flux_sums[push.top.first + view];
        bool may_be = !found && share > 0.0;
        chosen = may_be ? view : chosen;
        within = may_be ? left / share : within;
        found = found || (may_be && left < share);
        left -= share;
        ++view;
    } while (view < push.views);
    number = clamp(within, 0.0, RSM_BELOW_ONE);
    return chosen;
}

void main() {
    uint number = invocation_index();
    if (number >= push.lights) {
        return;
    }
    float total = 0.0;
    uint counted = 0u;
    do {
        total += flux_sums[push.top.first + counted];
        ++counted;
    } while (counted < push.views);
    if (number == 0u) {
        rsm_total = total;
    }
    if (!(total > 0.0)) {
        return;
    }
    vec2 point = sequence_point(number);
    uint view = choose_view(point.x, total);
    AtlasLevel level = push.top;
    ivec2 at = ivec2(0);
    while (level.side < push.side) {
        level.side *= 2u;
        level.first -= push.capacity * level.side * level.side;
        vec4 children;
        for (int child = 0; child < 4; ++child) {
            children[child] = flux_sums[atlas_texel(level, view, 2 * at + ivec2(child & 1, child >> 1))];
        }
        at = 2 * at + rsm_warp(children, point);
    }
    uint place = atlas_texel(level, view, at);
    RsmTexel texel = rsm_texels[place];
    RsmEmitter emitter = rsm_emitters[rsm_views[view].emitter];
    SceneTriangle t = load_triangle(texel.triangle);
    vec3 reached = t.a + texel.weights.x * (t.b - t.a) + texel.weights.y * (t.c - t.a);
    vec3 direction = rsm_direction(emitter, reached);
    Arrival a = arrival_at(Hit(0.0, texel.weights, texel.triangle), direction, push.scene_lower, push.scene_upper);
    vec3 power = texel.power * (total / flux_sums[place]);
    uvec4 quarters[VIRTUAL_LIGHT_QUARTERS];
    pack_virtual_light(new_virtual_light(a, texel.triangle, texel.weights, power, direction, 0u), quarters);
    for (uint i = 0u; i < VIRTUAL_LIGHT_QUARTERS; ++i) {
        virtual_light_records[VIRTUAL_LIGHT_QUARTERS * number + i] = quarters[i];
    }
}
