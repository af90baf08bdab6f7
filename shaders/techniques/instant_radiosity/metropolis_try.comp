#version 460
// Tries of chains: what a light of the pool brings to a pixel, with a ray. Of places anywhere, about states, about chosen proposals, or of lights at given pixels.
//
// Steps are symmetric: a large one draws pixel and light anew; a small one moves the pixel by a distance whose logarithm is even, around the picture's borders, and draws the
// light anew or keeps it. SVO-G5: B. Segovia et al., "Metropolis Instant Radiosity", 2007; step sizes after C. Kelemen et al., "A Simple and Robust Mutation Strategy for the Metropolis
// Light Transport Algorithm", 2002. Deterministic in (seed, step, index).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/metropolis_state.glsl"
#include "techniques/instant_radiosity/seen.glsl"
#include "techniques/instant_radiosity/visibility.glsl"
#include "transport/luminance.glsl"
#include "transport/random.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

// Of small steps, over the picture's sides.
const float METROPOLIS_STEP_LEAST = 1.0 / 1024.0;
const float METROPOLIS_STEP_MOST = 1.0 / 16.0;
// Shares of large steps, and of small ones that keep their light.
const float METROPOLIS_LARGE = 0.3;
const float METROPOLIS_KEEPS_LIGHT = 0.5;

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    float edge_bound;  // of EDGE_BOUND
    vec3 scene_upper;
    uint kind;         // METROPOLIS_*
    uint first;
    uint end;          // behind the last try
    uint pool;         // lights
    uint tries;        // of a chain's step; of powers, pixels of a light
    uint chains;
    uint step;
    uint seed;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;

layout(set = 0, binding = 1) uniform usampler2D seen_triangles;
layout(set = 0, binding = 2) uniform sampler2D seen_weights;
layout(set = 0, binding = 3, scalar) restrict buffer MetropolisTries { MetropolisTry metropolis_tries[]; };

#include "techniques/instant_radiosity/metropolis.glsl"

layout(set = 0, binding = 4, scalar) restrict readonly buffer MetropolisStates { MetropolisTry metropolis_states[]; };  // by chain
layout(set = 0, binding = 5, scalar) restrict readonly buffer MetropolisChosen { uint metropolis_chosen[]; };          // lights of the pool
layout(set = 0, binding = 6, scalar) restrict readonly buffer MetropolisPixels { uint metropolis_pixels[]; };          // of powers
layout(set = 0, binding = 7, scalar) restrict buffer MetropolisCounters {
    uint stopped;  // rays that stopped at their quota
} metropolis_counters;

#include "techniques/instant_radiosity/seen_pixel.glsl"
#include "techniques/instant_radiosity/single_ray.glsl"

uint some_light(float u) { return min(uint(u * float(push.pool)), push.pool - 1u); }

MetropolisTry anywhere(uvec4 words) {
    uint pixels = push.seen.width * push.seen.height;
    uint pixel = min(uint(unit_float(words.x) * float(pixels)), pixels - 1u);
    return MetropolisTry(pixel, some_light(unit_float(words.y)), 0.0);
}

// A step from a state.
MetropolisTry mutated(MetropolisTry from, uvec4 words) {
    uvec4 more = pcg4d(words);
    if (unit_float(words.z) < METROPOLIS_LARGE) {
        return anywhere(more);
    }
    float distance = METROPOLIS_STEP_LEAST * pow(METROPOLIS_STEP_MOST / METROPOLIS_STEP_LEAST, unit_float(words.x));
    float angle = 2.0 * PI * unit_float(words.y);
    vec2 size = vec2(push.seen.width, push.seen.height);
    vec2 place = (vec2(pixel_of(from.pixel)) + 0.5) / size + distance * vec2(cos(angle), sin(angle));
    uvec2 pixel = min(uvec2(fract(place) * size), uvec2(size) - 1u);
    uint light = unit_float(words.w) < METROPOLIS_KEEPS_LIGHT ? from.light : some_light(unit_float(more.z));
    return MetropolisTry(pixel.y * push.seen.width + pixel.x, light, 0.0);
}

// The place of a try, and what it is of.
MetropolisTry place_of_try(uint i, out uint slot) {
    slot = i;
    uvec4 words = metropolis_words(i, push.step, push.kind);
    if (push.kind == METROPOLIS_SEEDS) {
        return anywhere(words);
    }
    if (push.kind == METROPOLIS_PROPOSALS) {
        return mutated(metropolis_states[i / push.tries], words);
    }
    if (push.kind == METROPOLIS_REFERENCES) {
        uint chain = i / (push.tries - 1u);
        float sum;
        uint chosen = chosen_try(chain, push.step, sum);
        slot = push.chains * push.tries + i;
        return mutated(metropolis_tries[chain * push.tries + chosen], words);
    }
    slot = i - push.first;
    return MetropolisTry(metropolis_pixels[i % push.tries], metropolis_chosen[i / push.tries], 0.0);
}

// Luminance that a light brings to what a pixel sees, with a ray.
float brings(uint i, uint light) {
    Receiver r;
    if (!receiver_of(i, r)) {
        return 0.0;
    }
    Ray ray;
    float found = dot(r.throughput * connection(r, load_virtual_light(light), ray), LUMINANCE.rgb);
    if (!(found > 0.0)) {
        return found;
    }
    bool stopped;
    bool arrives = single_ray_arrives(ray, stopped);
    if (stopped) {
        atomicAdd(metropolis_counters.stopped, 1u);
    }
    return arrives && !stopped ? found : 0.0;
}

void main() {
    uint i = push.first + invocation_index();
    if (i >= push.end) {
        return;
    }
    uint slot;
    MetropolisTry found = place_of_try(i, slot);
    found.brings = brings(found.pixel, found.light);
    metropolis_tries[slot] = found;
}
