#version 460
// A virtual light for each pixel of a G-buffer: of candidates from even parts of all lights one is kept by what it would bring if nothing stood between.
//
// CL-VPL-RESERVOIRS: B. Bitterli et al., "Spatiotemporal reservoir resampling for real-time ray tracing with dynamic direct lighting", 2020; J. Talbot et al.,
// "Importance Resampling for Global Illumination", 2005. Deterministic in (seed, frame, pixel).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "accel/index_rays.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/reservoir.glsl"
#include "techniques/instant_radiosity/resampling.glsl"
#include "techniques/instant_radiosity/seen.glsl"
#include "transport/luminance.glsl"
#include "wide_counter.glsl"

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    float edge_bound;  // of EDGE_BOUND
    vec3 scene_upper;
    uint lights;
    uint candidates;
    uint first_pixel;
    uint end_pixel;
    uint frame;
    uint seed;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;

layout(set = 0, binding = 1) uniform usampler2D seen_triangles;
layout(set = 0, binding = 2) uniform sampler2D seen_weights;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer Reservoirs { Reservoir reservoirs[]; };
layout(set = 0, binding = 4, scalar) restrict buffer ReservoirCounters {
    uint connections[2];  // 64 bits, low word first: pairs of a pixel and a light
    uint tests[2];        // of visibility
} reservoir_counters;

#include "techniques/instant_radiosity/seen_pixel.glsl"

// Of the lights one that stands for all.
Reservoir drawn(Receiver r, uint pixel) {
    Reservoir kept = Reservoir(0u, 0.0);
    float of_kept = 0.0;
    float sum = 0.0;
    uint number = 0u;
    do {
        uvec4 words = reservoir_words(pixel, push.frame, number, push.seed);
        float part = (float(number) + unit_float(words.x)) / float(push.candidates);
        uint light = min(uint(part * float(push.lights)), push.lights - 1u);
        Ray ray;
        float key = dot(r.throughput * connection(r, load_virtual_light(light), ray), LUMINANCE.rgb);
        if (resample(unit_float(words.y), key, sum)) {
            kept.light = light;
            of_kept = key;
        }
        ++number;
    } while (number < push.candidates);
    if (of_kept > 0.0) {
        kept.weight = sum / of_kept * (float(push.lights) / float(push.candidates));
    }
    return kept;
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    Receiver r;
    if (!receiver_of(i, r)) {
        reservoirs[i] = Reservoir(0u, 0.0);
        return;
    }
    reservoirs[i] = drawn(r, i);
    COUNT_WIDE(reservoir_counters.connections, push.candidates)
}
