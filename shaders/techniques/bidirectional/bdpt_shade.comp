#version 460
// Where eye subpaths have arrived: the lamp that they meet and one that they sample, each weighted against all other ways to make the path, and one direction more.
// Shadow rays go to walk/shadow.comp; bdpt_connect.comp joins them to light subpaths before. In scenes with media what happens on the way comes before (bdpt_eye_medium.comp).
//
// Veach 1997, 10; I. Georgiev, "Implementing Vertex Connection and Merging", 2012. Unbiased.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "techniques/path/path_slots.glsl"
#include "walk/hand_on.glsl"
#include "techniques/bidirectional/bdpt_lights.glsl"
#include "transport/bsdf_label.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint least_bounces;
    vec3 scene_upper;
    uint most_bounces;
    WalkKey key;          // sequences are pixels, places in them samples
    uint roulette_start;  // first bounce at which Russian roulette may end a path
    float roulette_cap;   // largest probability to go on
    vec3 camera_forward;
    float camera_measure;
    float disk_pdf;       // 1/m2, of a place in beams of parallel light
} push;

#include "techniques/bidirectional/bdpt_eye.glsl"
#include "techniques/bidirectional/bdpt_strategy.glsl"
#include "techniques/path/path_roulette.glsl"
#include "walk/draws.glsl"

// Densities that are looked up at a vertex, one behind the other, so that their code is there once.
const uint LOOK_UPS = 3u;
const uint LOOK_UP_LIGHT = 0u;       // of light that is sampled
const uint LOOK_UP_LIGHT_BACK = 1u;  // of the way back from there
const uint LOOK_UP_BACK = 2u;        // of the way back from the direction that is sampled

// Shades the hit of the path in a slot. What it meets is added to `radiance`; `flags` say what waits at the place, and whether the path goes on.
void shade(uint slot, uint place, WalkState path, inout vec3 radiance, inout uint flags) {
    Hit hit = load_hit(place);
    uint state = take_path_state(path);
    bool counted = counts(path.bounce) && state_accepts(state);
    if (hit.triangle == NO_HIT) {
        if (HAS_ENVIRONMENT && counted) {
            SceneEnvironment e = load_environment();
            vec3 local = world_to_environment(e, path.direction);
            float others = 0.0;
            if (path.bounce > 0u) {
                vec2 densities = sky_densities(e, local, push.disk_pdf);
                PartialWeights w = subpath_weights[slot];
                others = densities.x * w.d_vcm + densities.y * w.d_vc;
            }
            radiance += path.throughput * environment_radiance(e, local) * strategy_weight(STRATEGY_EMISSION, 0.0, others);
        }
        return;
    }
    Arrival a = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    Surface s = a.surface;
    uint interior = arrival_interior(a, HAS_TRANSMISSION || HAS_MEDIA ? walk_gathered[slot].interior : OUTSIDE);
    if (!HAS_MEDIA) {
        path.throughput = absorbed(path.throughput, interior, hit.t);
    }
    PartialWeights weights = eye_weights(slot, path, a, hit.t);

    if ((HAS_AREA_LIGHTS || HAS_UNLIT) && counted) {
        vec3 emission = surface_emission(a.material, s, a.wo);
        if (emission != vec3(0.0)) {
            float others = 0.0;
            if (HAS_AREA_LIGHTS && s.light != NO_LIGHT && path.bounce > 0u) {
                vec2 densities = lamp_densities(s, a.material, a.wo);
                others = densities.x * weights.d_vcm + densities.y * weights.d_vc;
            }
            radiance += path.throughput * emission * strategy_weight(STRATEGY_EMISSION, 0.0, others);
        }
    }

    vec3 normal = arrival_normal(a);
    if (WRITE_AOVS && path.bounce == 0u) {
        vec3 albedo = bsdf_is_conductor(a.bsdf) ? conductor_average(a.bsdf) : a.bsdf.base_color;
        path_aovs[slot] = PathAov(albedo, hit.t, normal, 1u);
    }
    if (arrival_is_unlit(a) || path.bounce >= push.most_bounces) {
        return;
    }
    ScatteringFrame frame = scattering_frame(a, normal);
    uint bounce = path.bounce;

    LightSample light = no_light();
    float emitted = 0.0;
    // Lobes by which light counts.
    uint lit_lobes = LOBE_ALL;
    if (HAS_PATH_AUTOMATON) {
        lit_lobes = lobes_into(state, accepting_states()) & LOBE_ALL;
    }
    bool lit = HAS_LIGHTS && counts(bounce + 1u) && lit_lobes != 0u;
    if (lit) {
        light = sample_emission(s.point.position, bounce_words(slot, bounce, DIMENSION_LIGHT), push.disk_pdf, push.scene_lower, push.scene_upper, emitted);
        lit = light.radiance != vec3(0.0);
    }
    vec2 side = bounce_sample(slot, bounce, DIMENSION_SIDE);
    BsdfSample scattered = bsdf_sample(a.bsdf, frame.wo, vec3(bounce_sample(slot, bounce, DIMENSION_DIRECTION), side.x), LOBE_ALL);
    vec3 wi = frame_to_world(frame, scattered.wi);

    vec4 to_light = vec4(0.0);
    float from_light = 0.0;
    float back = 0.0;
    uint look_up = HAS_LIGHTS ? LOOK_UP_LIGHT : LOOK_UP_BACK;
    do {
        vec3 from = look_up == LOOK_UP_LIGHT ? a.wo : (look_up == LOOK_UP_LIGHT_BACK ? light.direction : wi);
        bool forwards = look_up == LOOK_UP_LIGHT;
        uint lobes = HAS_PATH_AUTOMATON && forwards ? lit_lobes : LOBE_ALL;
        vec4 found = scattering_by(a, from, forwards ? light.direction : a.wo, lobes);
        to_light = look_up == LOOK_UP_LIGHT ? found : to_light;
        from_light = look_up == LOOK_UP_LIGHT_BACK ? found.a : from_light;
        back = found.a;
        look_up += 1u;
    } while (look_up < LOOK_UPS);

    if (lit && to_light.rgb != vec3(0.0)) {
        vec3 wl = light.direction;
        // A light without extent is met by no path.
        float met = light.pdf > 0.0 ? to_light.a / light.pdf : 0.0;
        float walked = emitted * surface_cos(a, wl) * mis_behind(weights, from_light);
        float weight = strategy_weight(STRATEGY_LIGHT_SAMPLES, met, walked);
        ShadowRay ray;
        ray.slot = slot;
        ray.bounce = bounce + 1u;
        vec3 start = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, wl);
        ray.t_max = FAR_AWAY;
        ray.direction = wl;
        if (!light.infinite) {
            ray.t_max = 1.0;
            shadow_segment(s.point, s.geometric_normal, light.point, light.normal, start, ray.direction);
        }
        ray.origin = start;
        ray.contribution = path.throughput * light.radiance * to_light.rgb * weight;
        uint around = HAS_MEDIA ? s.around : OUTSIDE;
        uint passed = a.solid ? (dot(wl, frame.outward) < 0.0 ? s.material : around) : interior;
        if (!HAS_MEDIA && !light.infinite) {
            ray.contribution = absorbed(ray.contribution, passed, distance(s.point.position, light.point.position));
        }
        if (weight > 0.0) {
            float left_out = HAS_MEDIA ? way_left_out(s, start, wl) / length(ray.direction) : 0.0;
            flags |= store_shadow_ray(place, ray, passed, -left_out);
        }
    }

    if (HAS_PATH_AUTOMATON && scattered.flags != 0u) {
        uint after_base = state_behind(state, LOBE_DIFFUSE & LOBE_REFLECTION);
        uint after_microfacets = state_behind(state, LOBE_GLOSSY & LOBE_REFLECTION);
        scattered = bsdf_label(a.bsdf, frame.wo, scattered, LOBE_ALL, after_base == after_microfacets, side.y);
        state = state_behind(state, scattered.flags);
        if (state == PATH_SET_DEAD) {
            return;
        }
    }
    path.throughput *= scattered.weight;
    if (scattered.flags == 0u || !sides_agree(frame.z, frame.outward, wi) || path.throughput == vec3(0.0)) {
        return;
    }
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u && (a.bsdf.flags & BSDF_THIN) == 0u) {
        float eta = frame.wo.z > 0.0 ? a.bsdf.eta : 1.0 / a.bsdf.eta;
        path.eta_scale *= eta * eta;
        walk_gathered[slot].interior = frame.wo.z > 0.0 ? s.material : HAS_MEDIA ? s.around : OUTSIDE;
    }
    path.bounce = bounce + 1u;
    if (!path_roulette(path, side.y)) {
        return;
    }
    if (scattered.pdf > 0.0) {
        weights = mis_scatter(weights, surface_cos(a, wi), scattered.pdf, back);
    } else {
        weights = mis_scatter_delta(weights, surface_cos(a, wi), delta_ratio(a, frame, scattered, wi));
    }
    subpath_weights[slot] = weights;
    path.origin = departure(a, wi, path.throughput);
    path.direction = normalize(wi);
    path.pdf = scattered.pdf;
    put_path_state(path, state);
    flags |= store_walk(slot, path, HAS_MEDIA ? -way_left_out(s, path.origin, path.direction) : 0.0);
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    vec3 radiance = vec3(0.0);
    uint flags = 0u;
    WalkState path = load_walk(slot);
    if (HAS_MEDIA) {
        MediumEvent event = walk_medium_events[place];
        if ((event.flags & EVENT_HANDLED) != 0u) {
            return;
        }
        path.throughput *= event.weight;
    }
    shade(slot, place, path, radiance, flags);
    if (radiance != vec3(0.0)) {
        walk_gathered[slot].radiance += radiance;
    }
    walk_flags_out[place] = flags;
}
