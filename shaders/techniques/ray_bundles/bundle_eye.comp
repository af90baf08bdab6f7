#version 460
// Where eye paths begin: what a ray of each pixel meets, and the environment where that is nothing. A ray that its quota stops makes its sample NaN, which the film counts and
// leaves out. Deterministic in (seed, frame, pixel).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "accel/index.glsl"
#include "invocation.glsl"
#include "scene/camera.glsl"
#include "techniques/ray_bundles/bundle_vertex.glsl"
#include "transport/light_choice.glsl"
#include "transport/random.glsl"

layout(constant_id = 147) const bool SHOWS_EMITTED = true;

layout(push_constant, scalar) uniform Push {
    CameraRays camera;
    uint frame;
    uint seed;
    uint first_pixel;
    uint end_pixel;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Radiance { vec3 radiance[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer BundleVertices { BundleVertex bundle_vertices[]; };

void main() {
    uint pixel = push.first_pixel + invocation_index();
    if (pixel >= push.end_pixel) {
        return;
    }
    Sampler s = Sampler(pixel, push.frame, 0u, push.seed);
    vec2 place = vec2(pixel % push.camera.width, pixel / push.camera.width) + sample_2d(s);
    Ray ray = Ray(vec3(0.0), 0.0, vec3(0.0), FAR_AWAY);
    camera_ray(push.camera, place, square_to_disk(sample_2d(s)), ray.origin, ray.direction);
    Hit hit = no_hit(FAR_AWAY);
    bool stopped = closest_hit(ray, INDEX_START, hit) != INDEX_FINISHED;
    vec3 light = vec3(0.0);
    if (SHOWS_EMITTED && HAS_ENVIRONMENT && hit.triangle == NO_HIT) {
        SceneEnvironment e = load_environment();
        light = environment_radiance(e, world_to_environment(e, ray.direction));
    }
    radiance[pixel] = stopped ? vec3(uintBitsToFloat(0x7FC00000u)) : light;
    bundle_vertices[pixel] = BundleVertex(ray.direction, stopped ? NO_HIT : hit.triangle, vec3(1.0), hit.barycentrics);
}
