#version 460
// Virtual lights from reflective shadow maps: points of a low-discrepancy sequence, shifted as a whole each frame, come to views and texels in proportion to the
// luminance that those reflect, by the pyramids of their sums. Each light has as much of it.
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
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer RsmEmitters { RsmEmitter rsm_emitters[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer RsmTexels { RsmTexel rsm_texels[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer FluxSums { float flux_sums[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer RsmViews { RsmView rsm_views[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer VirtualLightRecords { uvec4 virtual_light_records[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer RsmTotal { float rsm_total; };  // luminance that all views reflect, W

vec3 unit_floats(uvec3 words) { return vec3(unit_float(words.x), unit_float(words.y), unit_float(words.z)); }

// Of a light in the unit cube.
vec3 sequence_point(uint number) {
    if (RSM_SEQUENCE == RSM_RANDOM) {
        return unit_floats(pcg4d(uvec4(number, push.frame, SEQUENCE_KEY, push.seed)).xyz);
    }
    bool is_halton = RSM_SEQUENCE == RSM_HALTON;
    vec3 point = vec3(rsm_radical_inverse(number, 2u), rsm_radical_inverse(number, 3u),
                      is_halton ? rsm_radical_inverse(number, 5u) : (float(number) + 0.5) / float(push.lights));
    vec3 shift = unit_floats(pcg4d(uvec4(JOINT_KEY, push.frame, SEQUENCE_KEY, push.seed)).xyz);
    return min(fract(point + shift), vec3(RSM_BELOW_ONE));
}

// The view in whose share of all luminance a number lies: never one without any.
uint choose_view(float number, float total) {
    float left = number * total;
    uint chosen = 0u;
    uint view = 0u;
    bool found = false;
    do {
        float share = flux_sums[push.top.first + view];
        chosen = !found && share > 0.0 ? view : chosen;
        found = found || (share > 0.0 && left < share);
        left -= share;
        ++view;
    } while (view < push.views);
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
    vec3 point = sequence_point(number);
    uint view = choose_view(point.z, total);
    AtlasLevel level = push.top;
    ivec2 at = ivec2(0);
    while (level.side < push.side) {
        level.side *= 2u;
        level.first -= push.capacity * level.side * level.side;
        vec4 children;
        for (int child = 0; child < 4; ++child) {
            children[child] = flux_sums[atlas_texel(level, view, 2 * at + ivec2(child & 1, child >> 1))];
        }
        at = 2 * at + rsm_warp(children, point.xy);
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
