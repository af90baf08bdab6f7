#version 460
// What vertices of light subpaths show the camera, as bdpt_camera.comp has it, in scenes with media: on surfaces and at collisions, by rays from the camera that pass boundaries and bring
// what the media let through.
//
// An invocation is for a vertex, and takes so many stretches of its ray a dispatch. One that has not come to its end notes where it is, and marks itself; further dispatches go on there.
//
// CL-BDPT-MEDIA: E. Lafortune and Y. Willems, "Rendering Participating Media with Bidirectional Path Tracing", 1996. Deterministic in (seed, pass, vertex).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/bidirectional/bdpt_media_set.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"
#include "techniques/bidirectional/bdpt_camera_words.glsl"

layout(constant_id = 54) const uint STRETCHES = 1u;  // of a ray, in a dispatch

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
    uint bounces;       // BOUNCES_MOST_SHIFT: the least number of scatterings and the greatest, or BOUNCES_UNBOUNDED
    vec3 scene_upper;
    uint interior;      // material of the body that the camera is in, or OUTSIDE
    uint pass;
    uint walks;         // of a group
    uint seed;
    uint first;         // vertex; with SPLATS_GO_ON for those that have stopped
    uint end;
    uint surrounding;   // index of the medium outside all bodies, or NO_MEDIUM
} push;

bool shows(uint bounces) {
    uint most = push.bounces >> BOUNCES_MOST_SHIFT;
    return bounces >= (push.bounces & BOUNCES_UNBOUNDED) && (most == BOUNCES_UNBOUNDED || bounces <= most);
}
uint body_of_camera() { return push.interior; }

#include "techniques/bidirectional/bdpt_sight.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"
#include "walk/medium_ray.glsl"

// Tells the walks of these rays through grids from other draws.
const uint SIGHT_RATIO_SEED = 0x73727469u;

// Goes on with the ray of a vertex; whether it has ended.
bool follow(Ray ray, uvec4 words, inout MediumRay at) {
    for (uint stretch = 0u; stretch < STRETCHES; ++stretch) {
        if (!search_stretch(ray, at)) {
            return false;
        }
        if (pass_stretch(ray, push.surrounding, uvec4(words.yzw, words.x ^ SIGHT_RATIO_SEED), at)) {
            return true;
        }
    }
    return false;
}

void main() {
    uint number = gl_GlobalInvocationID.x;
    uint index = (push.first & ~SPLATS_GO_ON) + number;
    if (index >= push.end) {
        return;
    }
    bool goes_on = (push.first & SPLATS_GO_ON) != 0u;
    if (goes_on && light_splats[index].pixel != SPLAT_STOPPED) {
        return;
    }
    uvec4 words = pcg4d(uvec4(index, push.pass, SPLAT_SEED, push.seed));
    uint pixel;
    ShadowWay shadow;
    vec3 radiance = splat(load_light_vertex(index), words, pixel, shadow);
    if (!goes_on) {
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
    MediumRay at = begin_medium_ray(shadow);
    if (goes_on) {
        at = medium_splat_rays[number];
    }
    if (!follow(shadow.ray, words, at)) {
        medium_splat_rays[number] = at;
        light_splats[index] = LightSplat(uvec3(0u), SPLAT_STOPPED);
        atomicAdd(bdpt_counters.remaining, 1u);
        return;
    }
    radiance = finite_or_black(radiance * at.transmittance);
    bool open = radiance != vec3(0.0);
    light_splats[index] = LightSplat(floatBitsToUint(radiance), open ? pixel : SPLAT_NONE);
    if (open) {
        // Bits of numbers that are not negative have their order.
        atomicMax(bdpt_counters.greatest_splat, floatBitsToUint(largest_component(radiance)));
    }
}
