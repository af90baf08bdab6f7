#version 460
// Ambient occlusion: what a uniform sky sends to the surface that a pixel shows, by one ray over its hemisphere. See techniques/ambient/mod.rs.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
#define INDEX_RESUMES false
#include "transport/features.glsl"
#include "accel/index.glsl"
#include "invocation.glsl"
#include "scene/camera.glsl"
#include "transport/arrival.glsl"
#include "transport/light_choice.glsl"
#include "transport/random.glsl"

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Radiance { vec3 radiance[]; };

layout(push_constant, scalar) uniform Push {
    CameraRays camera;
    uint frame, seed, first;  // the last one is the part's first pixel
    vec3 lower, upper;  // corners of the scene
} push;

// Turns the ray to where light may come from at what it has met; the share of that light that comes back along it.
vec3 scatter(Hit hit, inout Ray ray, vec2 u) {
    Arrival a = arrival_at(hit, ray.direction, push.lower, push.upper);
    ScatteringFrame f = scattering_frame(a, arrival_normal(a));
    vec3 local = square_to_cosine_hemisphere(u);
    vec3 wi = frame_to_world(f, local);
    vec3 share = PI * cosine_lobes_eval(a.bsdf, cosine_lobes(a.bsdf, f.wo.z, false, LOBE_DIFFUSE), local.z);  // over cos / pi
    ray = Ray(departure(a, wi, share), 0.0, wi, FAR_AWAY);
    return sides_agree(f.z, f.outward, wi) ? share : vec3(0.0);
}

void main() {
    uint pixel = push.first + invocation_index();
    if (pixel >= push.camera.width * push.camera.height) {
        return;
    }
    Sampler s = Sampler(pixel, push.frame, 0u, push.seed);
    vec2 place = vec2(pixel % push.camera.width, pixel / push.camera.width) + sample_2d(s);
    Ray ray = Ray(vec3(0.0), 0.0, vec3(0.0), FAR_AWAY);
    camera_ray(push.camera, place, square_to_disk(sample_2d(s)), ray.origin, ray.direction);
    vec3 light = environment_texel(0u).rgb;
    for (uint way = 0u; way < 2u && light != vec3(0.0); ++way) {
        Hit hit = no_hit(FAR_AWAY);
        bool stopped = closest_hit(ray, INDEX_START, hit) != INDEX_FINISHED;
        if (hit.triangle == NO_HIT && !stopped) {
            break;
        }
        // A ray that its quota stops makes a NaN, which the film counts and leaves out.
        light *= stopped ? vec3(uintBitsToFloat(0x7FC00000u)) : way == 0u ? scatter(hit, ray, sample_2d(s)) : vec3(0.0);
    }
    radiance[pixel] = light;
}
