#version 460
// Light where eye paths are: what is emitted towards the eye where they first arrive, and what comes from the lights and is scattered by the diffuse lobe, by a sample of
// the lights and one of the lobe, a ray each, weighted against each other; and the way on, along a bundle's lines in the sense that is above the surface.
//
// SVO-G6; E. Veach, PhD thesis, 1997, 9.2. The sense above the surface has the density 1 / (2 pi) over its hemisphere. A ray that its quota stops makes its sample NaN, which
// the film counts and leaves out. Deterministic in (seed, frame, pixel, bounce).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "accel/index.glsl"
#include "invocation.glsl"
#include "techniques/ray_bundles/bundle_vertex.glsl"
#include "transport/arrival.glsl"
#include "transport/light_choice.glsl"
#include "transport/random.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint frame;
    vec3 scene_upper;
    uint seed;
    vec3 line;       // direction of the bundle by which paths go on
    uint bounce;     // scatterings of the light that is found here directly
    uint first_pixel;
    uint end_pixel;
    uint does;       // BUNDLE_...
} push;

layout(set = 0, binding = 0, scalar) restrict buffer Radiance { vec3 radiance[]; };
layout(set = 0, binding = 1, scalar) restrict buffer BundleVertices { BundleVertex bundle_vertices[]; };

const uint BUNDLE_SLOTS = 2u;        // of random numbers, where light is
const uint BUNDLE_FIRST_SLOT = 2u;   // behind those of the eye's rays
// Light that scattered rays find besides light sampling.
const bool HAS_WIDE_LIGHTS = HAS_AREA_LIGHTS || HAS_ENVIRONMENT;
const uint TO_LIGHT = 0u;
const uint SCATTERED = 1u;

// A ray that tells what comes over it, and what of that is shown.
struct WayToLight {
    Ray ray;
    vec3 share;  // of what the ray finds; of the way to a light, what that sends
    float pdf;   // of the direction, by scattering
};

// f of the diffuse lobe; zero below the surface.
vec3 diffuse_share(Arrival a, ScatteringFrame frame, CosineLobes lobes, vec3 wi) {
    float cos_i = dot(wi, frame.z);
    return cos_i > 0.0 && sides_agree(frame.z, frame.outward, wi) ? cosine_lobes_eval(a.bsdf, lobes, cos_i) : vec3(0.0);
}

WayToLight way_to_light(Arrival a, ScatteringFrame frame, CosineLobes lobes, LightReceiver receiver, uvec2 word) {
    LightSample light = sample_light(receiver, word, push.scene_lower, push.scene_upper);
    vec3 wi = light.direction;
    vec3 normal = a.surface.geometric_normal;
    SurfacePoint point = a.surface.point;
    WayToLight way = WayToLight(Ray(point.position, 0.0, wi, FAR_AWAY), vec3(0.0), 0.0);
    if (light.radiance == vec3(0.0)) {
        return way;
    }
    float cos_i = max(dot(wi, frame.z), 0.0);
    float weight = HAS_WIDE_LIGHTS && light.pdf > 0.0 ? power_heuristic(light.pdf, cosine_hemisphere_pdf(cos_i)) : 1.0;
    way.share = light.radiance * diffuse_share(a, frame, lobes, wi) * (cos_i * weight);
    way.ray.origin = offset_ray_origin(point.position, point.error, normal, wi);
    if (!light.infinite) {
        way.ray.t_max = 1.0;
        shadow_segment(point, normal, light.point, light.normal, way.ray.origin, way.ray.direction);
    }
    return way;
}

WayToLight way_scattered(Arrival a, ScatteringFrame frame, CosineLobes lobes, vec2 u) {
    vec3 local = square_to_cosine_hemisphere(u);
    vec3 wi = frame_to_world(frame, local);
    SurfacePoint point = a.surface.point;
    vec3 origin = offset_ray_origin(point.position, point.error, a.surface.geometric_normal, wi);
    // f cos over the density, cos / pi.
    return WayToLight(Ray(origin, 0.0, wi, FAR_AWAY), diffuse_share(a, frame, lobes, wi) * PI, cosine_hemisphere_pdf(local.z));
}

// What a scattered ray finds that light sampling finds, too, by its weight against that.
vec3 found_light(WayToLight way, LightReceiver receiver, Hit hit) {
    vec3 emission = vec3(0.0);
    float light_pdf = 0.0;
    if (hit.triangle == NO_HIT) {
        if (HAS_ENVIRONMENT) {
            SceneEnvironment e = load_environment();
            vec4 seen = environment_look_up(e, world_to_environment(e, way.ray.direction));
            emission = seen.rgb;
            light_pdf = environment_choice_probability() * seen.a;
        }
    } else if (HAS_AREA_LIGHTS) {
        Surface s = surface_at(hit, push.scene_lower, push.scene_upper);
        emission = surface_emission(load_material(s.material), s, -way.ray.direction);
        light_pdf = s.light != NO_LIGHT ? triangle_light_pdf(receiver, s, way.ray.direction, hit.t) : 0.0;
    }
    return emission == vec3(0.0) ? emission : way.share * emission * power_heuristic(way.pdf, light_pdf);
}

// Light that arrives directly, as the diffuse lobe scatters it.
vec3 direct_light(Arrival a, ScatteringFrame frame, CosineLobes lobes, uint pixel) {
    LightReceiver receiver = LightReceiver(a.surface.point.position, frame.z);
    Sampler s = Sampler(pixel, push.frame, BUNDLE_FIRST_SLOT + BUNDLE_SLOTS * (push.bounce - 1u), push.seed);
    uvec2 word = sampler_bits(s);
    s.dimension += 1u;
    vec2 direction = sample_2d(s);
    vec3 light = vec3(0.0);
    uint number = TO_LIGHT;
    do {
        WayToLight way;
        if (number == TO_LIGHT) {
            way = way_to_light(a, frame, lobes, receiver, word);
        } else {
            way = way_scattered(a, frame, lobes, direction);
        }
        if (way.share != vec3(0.0)) {
            Hit hit = no_hit(way.ray.t_max);
            bool stopped = closest_hit(way.ray, INDEX_START, hit) != INDEX_FINISHED;
            if (number == SCATTERED) {
                light += found_light(way, receiver, hit);
            } else {
                light += hit.triangle == NO_HIT ? way.share : vec3(0.0);
            }
            light = stopped ? vec3(uintBitsToFloat(0x7FC00000u)) : light;
        }
        ++number;
    } while (number <= (HAS_WIDE_LIGHTS ? SCATTERED : TO_LIGHT));
    return light;
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    BundleVertex vertex = bundle_vertices[i];
    if (vertex.triangle == NO_HIT) {
        return;
    }
    Arrival a = arrival_at(Hit(0.0, vertex.barycentrics, vertex.triangle), vertex.direction, push.scene_lower, push.scene_upper);
    vec3 light = vec3(0.0);
    if (HAS_AREA_LIGHTS && (push.does & BUNDLE_SHOWS_EMITTED) != 0u) {
        light = surface_emission(a.material, a.surface, a.wo);
    }
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    CosineLobes lobes = cosine_lobes(a.bsdf, frame.wo.z, false, LOBE_DIFFUSE);
    if (lobes.diffuse == vec3(0.0)) {
        vertex.triangle = NO_HIT;
    } else {
        if ((push.does & BUNDLE_SHOWS_DIRECT) != 0u) {
            light += direct_light(a, frame, lobes, i);
        }
        vec3 wi = dot(push.line, a.facing) < 0.0 ? -push.line : push.line;
        vec3 share = diffuse_share(a, frame, lobes, wi) * (dot(wi, frame.z) / UNIFORM_HEMISPHERE_PDF);
        light *= vertex.throughput;
        vertex.throughput *= share;
        vertex.direction = wi;
        if ((push.does & BUNDLE_GOES_ON) == 0u || vertex.throughput == vec3(0.0)) {
            vertex.triangle = NO_HIT;
        }
    }
    bundle_vertices[i] = vertex;
    radiance[i] += light;
}
