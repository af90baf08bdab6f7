#version 460
// Radiance from its subset of a frame's virtual lights at each place of a split G-buffer: the scattering functions at both ends, the geometry term up to its
// bound, and visibility by nothing, by a shadow ray or by the light's shadow map.
//
// An invocation is for a place, and takes the next lights of its subset in their order, up to the last one that has a map now, so many a dispatch. What it has had is
// kept, so that sums are the same bits however lights are shared out among dispatches; pairs of places and lights are nowhere stored. Workgroups have one subset.
//
// SVO-P12, SVO-B0, SVO-G0: C. Sun, "Many-light real-time global illumination using sparse voxel octree", 2015, §3.3 and §4.10. Deterministic.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "invocation.glsl"
#include "raster/omni_shadow_set.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/seen.glsl"
#include "techniques/instant_radiosity/visibility.glsl"
#include "wide_counter.glsl"

layout(constant_id = 45) const uint LIGHTS_AT_ONCE = 1u;  // of a place, in a dispatch
layout(constant_id = 144) const bool KEEPS_COLORS = false;  // by which a filter divides light before it averages it

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    float edge_bound;  // of EDGE_BOUND
    vec3 scene_upper;
    uint lights;
    uint end_light;    // behind the last one that is taken now
    uint first_place;
    uint end_place;
    uint interleave;   // tiles along a side
    uint subsets;      // of the lights
    uint first_subset; // of the first tile
    uint first_map;    // light of the first shadow map
    int map_side;      // texels
} push;

#include "transport/random.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;

#include "techniques/instant_radiosity/seen_receiver.glsl"
#include "transport/microfacet_albedo.glsl"

layout(set = 0, binding = 1, scalar) restrict readonly buffer SplitPlaces { SplitPlace split_places[]; };
layout(set = 0, binding = 2, scalar) restrict buffer SplitStates { GatherState split_states[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer SplitColors { vec3 split_colors[]; };
layout(set = 0, binding = 4, scalar) restrict buffer DeferredCounters {
    uint remaining;        // places that have not had all lights up to the last one
    uint connections[2];   // 64 bits, low word first: pairs of a place and a light
    uint tests[2];         // of visibility: pairs that might bring light
} deferred_counters;

// Prepares the receiver of a place; false where nothing is gathered.
bool begin_receiver(uint place, out Receiver r) {
    SplitPlace seen = split_places[place];
    uvec2 pixel;
    if (seen.triangle == NO_HIT || !interleave_merge(place, uvec2(push.seen.width, push.seen.height), push.interleave, pixel)) {
        return false;
    }
    return receiver_of_pixel(push.seen, pixel, seen, r);
}

// Share of a light that comes to the receiver over a connection; false where the ray that tells is stopped.
bool visibility(Receiver r, VirtualLight light, uint number, Ray ray, inout uint cursor, out float share) {
    share = 1.0;
    if (VISIBILITY == VISIBILITY_RAYS) {
        if (HAS_ALPHA) {
            // Cut-outs are there or not, whoever asks.
            candidate_key = uvec4(0u);
        }
        Hit hit = no_hit(ray.t_max);
        cursor = any_hit(ray, cursor, hit);
        share = hit.triangle != NO_HIT ? 0.0 : 1.0;
        return cursor == INDEX_FINISHED;
    }
    if (VISIBILITY == VISIBILITY_MAPS) {
        SurfacePoint point = r.arrival.surface.point;
        vec3 normal = r.arrival.surface.geometric_normal;
        float slack = dot(abs(normal), point.error);
        share = omni_shadow_visibility(number - push.first_map, push.map_side, light.position + light.offset * light.normal, point.position, normal, slack);
    }
    return true;
}

// Goes on with the lights of a place up to `end`.
void gather(Receiver r, uint end, inout GatherState at, out uint tests) {
    tests = 0u;
    uint last = min(at.light + LIGHTS_AT_ONCE, end);
    bool stopped = false;
    do {
        VirtualLight light = load_virtual_light(at.light);
        Ray ray;
        vec3 found = r.throughput * connection(r, light, ray);
        if (found != vec3(0.0)) {
            tests += at.cursor == INDEX_START ? 1u : 0u;
            float share;
            stopped = !visibility(r, light, at.light, ray, at.cursor, share);
            at.sum += stopped ? vec3(0.0) : share * found;
        }
        at.cursor = stopped ? at.cursor : INDEX_START;
        at.light += stopped ? 0u : 1u;
    } while (!stopped && at.light < last);
}

// Albedo towards the eye of all that virtual lights light, which their light is divided by before it is averaged with that of neighbours.
vec3 scattered_color(Receiver r) {
    Bsdf b = r.arrival.bsdf;
    float cos_o = abs(r.frame.wo.z);
    vec3 color = cosine_lobes(b, cos_o, false, LOBE_DIFFUSE | LOBE_GLOSSY).seen;
    if (!bsdf_is_delta(b)) {
        color += microfacet_albedo(b, cos_o);
        if (HAS_TRANSMISSION) {
            color += (1.0 - bsdf_metallic(b)) * bsdf_transmission(b) * b.base_color;
        }
    }
    return color;
}

void main() {
    uint place = push.first_place + invocation_index();
    if (place >= push.end_place) {
        return;
    }
    GatherState at = split_states[place];
    uint tile = place / interleave_stride(uvec2(push.seen.width, push.seen.height), push.interleave);
    uint subset = interleave_subset_of_tile(tile, push.first_subset, push.subsets);
    uint end = min(interleave_lights(subset, push.subsets, push.lights).y, push.end_light);
    if (at.light >= end) {
        return;
    }
    Receiver r;
    if (!begin_receiver(place, r)) {
        split_states[place].light = push.lights;
        if (KEEPS_COLORS) {
            split_colors[place] = vec3(0.0);
        }
        return;
    }
    uint first = at.light;
    uint tests;
    gather(r, end, at, tests);
    split_states[place] = at;
    if (KEEPS_COLORS) {
        split_colors[place] = scattered_color(r);
    }
    COUNT_WIDE(deferred_counters.connections, at.light - first)
    COUNT_WIDE(deferred_counters.tests, tests)
    if (at.light < end) {
        atomicAdd(deferred_counters.remaining, 1u);
    }
}
