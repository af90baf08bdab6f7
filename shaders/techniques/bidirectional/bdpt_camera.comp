#version 460
// What vertices of light subpaths show the camera: the pixel and the radiance that each adds to it, weighted against all other ways to make the path, where nothing
// stands between. The mean of a pixel's light is that over all walks of a group.
//
// A vertex whose ray a quota stops marks itself; further dispatches go on there. Thin lenses have a point of their own for each vertex.
// Veach 1997, 10.3.2; I. Georgiev, "Implementing Vertex Connection and Merging", 2012. Deterministic in (seed, pass, vertex).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 origin;
    float half_width;   // of the picture at distance 1, or in metres (orthographic)
    vec3 right;
    float half_height;
    vec3 up;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    uint width;
    uint height;
    vec3 scene_lower;
    uint least_bounces;
    vec3 scene_upper;
    uint most_bounces;
    uint pass;
    uint walks;         // of a group
    uint seed;
    uint first;         // vertex
    uint end;
    uint goes_on;       // 1 for vertices that have stopped
} push;

bool shows(uint bounces) { return bounces >= push.least_bounces && bounces <= push.most_bounces; }
uint body_of_camera() { return 0xFFFFFFFFu; }

#include "techniques/bidirectional/bdpt_sight.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

void main() {
    uint index = push.first + gl_GlobalInvocationID.x;
    if (index >= push.end) {
        return;
    }
    uint cursor = INDEX_START;
    if (push.goes_on != 0u) {
        LightSplat before = light_splats[index];
        if (before.pixel != SPLAT_STOPPED) {
            return;
        }
        cursor = before.words.x;
    }
    uvec4 words = pcg4d(uvec4(index, push.pass, SPLAT_SEED, push.seed));
    uint pixel;
    ShadowWay shadow;
    vec3 radiance = splat(load_light_vertex(index), words, pixel, shadow);
    if (cursor == INDEX_START) {
        COUNT_WIDE(bdpt_counters.in_view, pixel != SPLAT_NONE ? 1u : 0u)
        COUNT_WIDE(bdpt_counters.shadow_rays, radiance != vec3(0.0) ? 1u : 0u)
    }
    if (radiance == vec3(0.0)) {
        light_splats[index] = LightSplat(uvec3(0u), SPLAT_NONE);
        return;
    }
    if (HAS_ALPHA) {
        candidate_key = pcg4d(words);
    }
    Hit hit = no_hit(shadow.ray.t_max);
    cursor = any_hit(shadow.ray, cursor, hit);
    if (cursor != INDEX_FINISHED) {
        light_splats[index] = LightSplat(uvec3(cursor, 0u, 0u), SPLAT_STOPPED);
        atomicAdd(bdpt_counters.remaining, 1u);
        return;
    }
    bool open = hit.triangle == NO_HIT;
    light_splats[index] = LightSplat(floatBitsToUint(radiance), open ? pixel : SPLAT_NONE);
    if (open) {
        // Bits of numbers that are not negative have their order.
        atomicMax(bdpt_counters.greatest_splat, floatBitsToUint(largest_component(radiance)));
    }
}
