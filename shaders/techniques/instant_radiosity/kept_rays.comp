#version 460
// Rays of kept virtual lights: whether their lamps see them from where they are now, and what new directions meet. A direction that left the scene is seen as long as it does.
//
// SVO-G2: S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", 2007. Deterministic.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "invocation.glsl"
#include "transport/random.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"
#include "techniques/instant_radiosity/kept.glsl"
#include "techniques/instant_radiosity/virtual_light.glsl"

layout(push_constant, scalar) uniform Push {
    uint lights;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;
layout(set = 0, binding = 1, scalar) restrict readonly buffer KeptLights { KeptLight kept_lights[]; };
layout(set = 0, binding = 2, scalar) restrict buffer KeptHits { KeptHit kept_hits[]; };

// From a light, just off its surface, to its lamp.
Ray ray_to_lamp(uint number, vec3 lamp) {
    int first = int(VIRTUAL_LIGHT_QUARTERS * number);
    // The place of a light is in its first two quarters.
    VirtualLight light = unpack_virtual_light(texelFetch(virtual_light_texels, first), texelFetch(virtual_light_texels, first + 1), uvec4(0u), uvec4(0u));
    vec3 origin = light.position + light.offset * light.normal;
    return Ray(origin, 0.0, lamp - origin, 1.0);
}

void main() {
    uint number = invocation_index();
    if (number >= push.lights) {
        return;
    }
    KeptLight light = kept_lights[number];
    bool is_asked = light.asks == KEPT_ASKED;
    if (!is_asked && light.asks != KEPT_NEW) {
        return;
    }
    Ray ray = Ray(light.lamp, 0.0, light.direction, FAR_AWAY);
    if (is_asked && kept_hits[number].triangle != NO_HIT) {
        ray = ray_to_lamp(number, light.lamp);
    }
    if (HAS_ALPHA) {
        // Cut-outs are there or not, whoever asks.
        candidate_key = uvec4(0u);
    }
    Hit hit = no_hit(ray.t_max);
    bool stopped = closest_hit(ray, INDEX_START, hit) != INDEX_FINISHED;
    if (is_asked) {
        kept_hits[number].sight = stopped ? KEPT_STOPPED : hit.triangle == NO_HIT ? KEPT_SEEN : KEPT_HIDDEN;
        return;
    }
    KeptHit found = KeptHit(vec3(0.0), hit.triangle, hit.barycentrics, stopped ? KEPT_STOPPED : KEPT_SEEN);
    if (hit.triangle != NO_HIT) {
        SceneTriangle t = load_triangle(hit.triangle);
        found.position = t.a + hit.barycentrics.x * (t.b - t.a) + hit.barycentrics.y * (t.c - t.a);
    }
    kept_hits[number] = found;
}
