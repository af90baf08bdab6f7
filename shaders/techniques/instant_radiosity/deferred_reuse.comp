#version 460
// Light of the virtual lights that a pixel and its neighbours keep: of all of them one is taken by what it would bring to the pixel, weighted against the chance that
// each of them had to keep it, with one test of visibility.
//
// Neighbours count that see the same surface, whatever they keep, so that the light's mean is that of all lights: CL-VPL-RESERVOIRS, B. Bitterli et al.,
// "Spatiotemporal reservoir resampling for real-time ray tracing with dynamic direct lighting", 2020, with the balance heuristic over what lights bring to each;
// D. Lin et al., "Generalized Resampled Importance Sampling", 2022. A ray that its quota stops makes its sample NaN, which the film counts and leaves out.
// Deterministic in (seed, frame, pixel).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/reservoir.glsl"
#include "techniques/instant_radiosity/resampling.glsl"
#include "techniques/instant_radiosity/seen.glsl"
#include "techniques/instant_radiosity/visibility.glsl"
#include "transport/luminance.glsl"
#include "walk/candidate_alpha.glsl"
#include "wide_counter.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

layout(constant_id = 153) const uint NEIGHBOURS = 0u;  // that are asked, at most

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    float edge_bound;  // of EDGE_BOUND
    vec3 scene_upper;
    float scale;       // of sums over all lights
    float reach;       // of neighbours, pixels
    float plane_max;   // distance from the tangent plane, m
    float normal_min;  // cosine of the angle between normals
    uint first_pixel;
    uint end_pixel;
    uint frame;
    uint seed;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;

layout(set = 0, binding = 1) uniform usampler2D seen_triangles;
layout(set = 0, binding = 2) uniform sampler2D seen_weights;
layout(set = 0, binding = 3) uniform sampler2D seen_positions;
layout(set = 0, binding = 4) uniform usampler2D seen_normals;
layout(set = 0, binding = 5, scalar) restrict readonly buffer Reservoirs { Reservoir reservoirs[]; };
layout(set = 0, binding = 6, scalar) restrict buffer ReservoirCounters {
    uint connections[2];  // 64 bits, low word first: pairs of a pixel and a light
    uint tests[2];        // of visibility
} reservoir_counters;
layout(set = 0, binding = 7, scalar) restrict buffer Radiance { vec3 radiance[]; };

#include "techniques/instant_radiosity/seen_pixel.glsl"
#include "techniques/instant_radiosity/seen_surface.glsl"
#include "techniques/instant_radiosity/single_ray.glsl"

// The pixel, the first, and its neighbours.
uint member_pixels[RESERVOIR_MEMBERS_MAX];
uint members = 1u;

// What they keep: what it brings to its own pixel, to all of them together, and to the first.
Reservoir kept[RESERVOIR_MEMBERS_MAX];
float brings_own[RESERVOIR_MEMBERS_MAX];
float brings_all[RESERVOIR_MEMBERS_MAX];
float brings_first[RESERVOIR_MEMBERS_MAX];

void find_neighbours(uint i) {
    ivec2 pixel = ivec2(pixel_of(i));
    ivec2 size = ivec2(push.seen.width, push.seen.height);
    vec3 position = texelFetch(seen_positions, pixel, 0).xyz;
    vec3 normal = seen_normal(pixel);
    for (uint number = 0u; number < NEIGHBOURS; ++number) {
        uvec4 words = reservoir_words(i, push.frame, RESERVOIR_NEIGHBOURS + number, push.seed);
        ivec2 other = pixel + ivec2(round(push.reach * (2.0 * vec2(unit_float(words.x), unit_float(words.y)) - 1.0)));
        if (other == pixel || any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, size))) {
            continue;
        }
        if (is_same_surface(position, normal, other, push.plane_max, push.normal_min)) {
            member_pixels[members] = uint(other.y) * push.seen.width + uint(other.x);
            ++members;
        }
    }
}

// What each light that is kept brings to each member, of which the first is the last one looked at; false where that scatters into single directions alone.
bool compare_members(out Receiver r) {
    for (uint i = 0u; i < members; ++i) {
        kept[i] = reservoirs[member_pixels[i]];
        brings_own[i] = 0.0;
        brings_all[i] = 0.0;
        brings_first[i] = 0.0;
    }
    bool gathers = false;
    for (uint left = members; left > 0u; --left) {
        uint member = left - 1u;
        gathers = receiver_of(member_pixels[member], r);
        for (uint i = 0u; i < members; ++i) {
            if (!gathers || kept[i].weight == 0.0) {
                continue;
            }
            Ray ray;
            float key = dot(r.throughput * connection(r, load_virtual_light(kept[i].light), ray), LUMINANCE.rgb);
            brings_all[i] += key;
            brings_own[i] = i == member ? key : brings_own[i];
            brings_first[i] = member == 0u ? key : brings_first[i];
        }
    }
    return gathers;
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    member_pixels[0] = i;
    if (NEIGHBOURS > 0u && texelFetch(seen_positions, ivec2(pixel_of(i)), 0).w != 0.0) {
        find_neighbours(i);
    }
    Receiver r;
    if (!compare_members(r)) {
        return;
    }
    COUNT_WIDE(reservoir_counters.connections, members * members)
    float sum = 0.0;
    uint taken = 0u;
    for (uint member = 0u; member < members; ++member) {
        uvec4 words = reservoir_words(i, push.frame, RESERVOIR_NEIGHBOURS + NEIGHBOURS + member, push.seed);
        float all = brings_all[member];
        float weight = all > 0.0 ? brings_own[member] / all * brings_first[member] * kept[member].weight : 0.0;
        taken = resample(unit_float(words.x), weight, sum) ? member : taken;
    }
    if (!(sum > 0.0)) {
        return;
    }
    Ray ray;
    vec3 found = r.throughput * connection(r, load_virtual_light(kept[taken].light), ray);
    COUNT_WIDE(reservoir_counters.tests, 1u)
    bool stopped;
    float share = single_ray_arrives(ray, stopped) ? 1.0 : 0.0;
    share = stopped ? uintBitsToFloat(0x7FC00000u) : share;
    radiance[i] += found * (push.scale * sum / brings_first[taken] * share);
}
