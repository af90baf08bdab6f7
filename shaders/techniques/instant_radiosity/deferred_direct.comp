#version 460
// What the pixels of a G-buffer show without virtual lights: light that is emitted towards the eye, and light that arrives directly and is scattered once by other
// lobes than mirrors. A sample of the lights and one of the scattering function, a ray each, weighted against each other.
//
// SVO-P10, BG-2: E. Veach, PhD thesis, 1997, 9.2; a pixel's light sources are chosen by power. A ray that its quota stops makes its sample NaN, which the film counts
// and leaves out. Deterministic in (seed, frame, pixel).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define INDEX_RESUMES false

#include "transport/features.glsl"
#include "invocation.glsl"
#include "transport/random.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"
#include "techniques/instant_radiosity/seen.glsl"
#include "transport/arrival.glsl"
#include "transport/light_choice.glsl"

layout(constant_id = 147) const bool SHOWS_EMITTED = true;
layout(constant_id = 148) const bool SHOWS_DIRECT = true;

// Sets of lobes that scatter into more than one direction.
const uint LOBE_ROUGH = LOBE_DIFFUSE | LOBE_GLOSSY;
// Light that scattered rays find besides light sampling.
const bool HAS_WIDE_LIGHTS = HAS_AREA_LIGHTS || HAS_ENVIRONMENT;
const uint WAY_TO_LIGHT = 0u;
const uint WAY_SCATTERED = 1u;

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    uint frame;
    vec3 scene_upper;
    uint seed;
    uint first_pixel;
    uint end_pixel;
} push;

layout(set = 0, binding = 0) uniform usampler2D seen_triangles;
layout(set = 0, binding = 1) uniform sampler2D seen_weights;
layout(set = 0, binding = 2, scalar) restrict writeonly buffer Radiance { vec3 radiance[]; };

// A ray that tells what comes over it, and what of that is shown.
struct DirectWay {
    Ray ray;
    vec3 share;     // of what the ray finds; of the way to a light, what that sends
    float pdf;      // of the direction, by scattering
    uint interior;  // body that it goes through
};

DirectWay no_way() { return DirectWay(Ray(vec3(0.0), 0.0, vec3(0.0), 0.0), vec3(0.0), 0.0, OUTSIDE); }

DirectWay way_to_light(Arrival a, ScatteringFrame frame, LightReceiver receiver, uint interior, uvec2 word) {
    DirectWay way = no_way();
    LightSample light = sample_light(receiver, word, push.scene_lower, push.scene_upper);
    vec3 wi = light.direction;
    if (light.radiance == vec3(0.0) || !sides_agree(frame.z, frame.outward, wi)) {
        return way;
    }
    vec4 f = bsdf_eval_pdf(a.bsdf, frame.wo, world_to_frame(frame, wi), LOBE_ROUGH);
    float weight = HAS_WIDE_LIGHTS && light.pdf > 0.0 ? power_heuristic(light.pdf, f.a) : 1.0;
    way.share = light.radiance * f.rgb * weight;
    SurfacePoint point = a.surface.point;
    way.ray = Ray(offset_ray_origin(point.position, point.error, a.surface.geometric_normal, wi), 0.0, wi, FAR_AWAY);
    way.interior = a.solid ? (dot(wi, frame.outward) < 0.0 ? a.surface.material : OUTSIDE) : interior;
    if (!light.infinite) {
        way.ray.t_max = 1.0;
        shadow_segment(point, a.surface.geometric_normal, light.point, light.normal, way.ray.origin, way.ray.direction);
        way.share = absorbed(way.share, way.interior, distance(point.position, light.point.position));
    }
    return way;
}

DirectWay way_scattered(Arrival a, ScatteringFrame frame, uint interior, vec3 u) {
    DirectWay way = no_way();
    BsdfSample scattered = bsdf_sample(a.bsdf, frame.wo, u, LOBE_ROUGH);
    vec3 wi = frame_to_world(frame, scattered.wi);
    if (scattered.flags == 0u || !sides_agree(frame.z, frame.outward, wi)) {
        return way;
    }
    way.interior = interior;
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u && (a.bsdf.flags & BSDF_THIN) == 0u) {
        way.interior = frame.wo.z > 0.0 ? a.surface.material : OUTSIDE;
    }
    way.share = scattered.weight;
    vec3 origin = departure(a, wi, way.share);
    way.ray = Ray(origin, 0.0, normalize(wi), FAR_AWAY);
    way.pdf = scattered.pdf;
    return way;
}

// What a scattered ray finds that light sampling finds, too, by its weight against that.
vec3 found_light(DirectWay way, LightReceiver receiver, Hit hit) {
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
        emission = absorbed(emission, way.interior, hit.t);
    }
    return emission == vec3(0.0) ? emission : way.share * emission * power_heuristic(way.pdf, light_pdf);
}

// Light that arrives directly, scattered towards the eye.
vec3 direct_light(Arrival a, uint interior, uint pixel) {
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    bool transmits = HAS_TRANSMISSION && a.material.transmission > 0.0;
    LightReceiver receiver = LightReceiver(a.surface.point.position, transmits ? vec3(0.0) : frame.z);
    Sampler s = Sampler(pixel, push.frame, 0u, push.seed);
    uvec2 word = sampler_bits(s);
    s.dimension += 1u;
    vec2 direction = sample_2d(s);
    float side = sample_1d(s);
    vec3 light = vec3(0.0);
    uint number = WAY_TO_LIGHT;
    do {
        DirectWay way;
        if (number == WAY_TO_LIGHT) {
            way = way_to_light(a, frame, receiver, interior, word);
        } else {
            way = way_scattered(a, frame, interior, vec3(direction, side));
        }
        if (way.share != vec3(0.0)) {
            if (HAS_ALPHA) {
                candidate_key = uvec4(0u);
            }
            Hit hit = no_hit(way.ray.t_max);
            bool stopped = closest_hit(way.ray, INDEX_START, hit) != INDEX_FINISHED;
            if (number == WAY_SCATTERED) {
                light += found_light(way, receiver, hit);
            } else {
                light += hit.triangle == NO_HIT ? way.share : vec3(0.0);
            }
            light = stopped ? vec3(uintBitsToFloat(0x7FC00000u)) : light;
        }
        ++number;
    } while (number <= (HAS_WIDE_LIGHTS ? WAY_SCATTERED : WAY_TO_LIGHT));
    return light;
}

vec3 seen_light(Hit hit, uint pixel, vec3 origin, vec3 direction) {
    Arrival a = arrival_at(hit, direction, push.scene_lower, push.scene_upper);
    uint interior = arrival_interior(a, OUTSIDE);
    vec3 light = SHOWS_EMITTED && HAS_AREA_LIGHTS ? surface_emission(a.material, a.surface, a.wo) : vec3(0.0);
    if (SHOWS_DIRECT && arrival_has_rough_lobes(a)) {
        light += direct_light(a, interior, pixel);
    }
    return absorbed(light, interior, distance(origin, a.surface.point.position));
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    uvec2 pixel = uvec2(i % push.seen.width, i / push.seen.width);
    vec3 origin;
    vec3 direction = seen_direction(push.seen, pixel, origin);
    uint triangle = texelFetch(seen_triangles, ivec2(pixel), 0).x;
    vec3 light = vec3(0.0);
    if (triangle != NO_HIT) {
        light = seen_light(Hit(0.0, texelFetch(seen_weights, ivec2(pixel), 0).xy, triangle), i, origin, direction);
    } else if (SHOWS_EMITTED && HAS_ENVIRONMENT) {
        SceneEnvironment e = load_environment();
        light = environment_radiance(e, world_to_environment(e, direction));
    }
    radiance[i] = light;
}
