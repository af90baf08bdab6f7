#version 460
// Wavefront path tracer: what happens where a path has arrived. Emission with its multiple-importance weight, one light sample (its
// shadow ray goes to walk/shadow.comp), one direction of the surface's scattering function, Russian roulette.
//
// BG-2, BG-3: unidirectional path tracing with next-event estimation (Kajiya 1986; Veach 1997, 9 and 10.3.2). Unbiased.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/count_fetches.glsl"

#include "transport/features.glsl"
#include "techniques/path/path_slots.glsl"
#include "transport/arrival.glsl"
#include "transport/bsdf_label.glsl"
#include "transport/edge_bound.glsl"
#include "transport/light_choice.glsl"
#include "transport/path_set.glsl"
#include "transport/photon_share.glsl"
#include "techniques/path/path_bounce.glsl"
#include "walk/hand_on.glsl"

#include "walk/draws.glsl"

// Other means have the light of edges between two rough scatterings up to this bound; paths have what it leaves out.
layout(constant_id = 35) const uint EDGE_BOUND = EDGE_UNBOUNDED;

// The entry of path_even_distances of the path under way, and that of path_flights with its last scattering.
float path_even_distance2 = 0.0;
float path_evenness = 1.0;

// Share of the path in light that its ray meets. Until the second scattering (path_even_distance2 at most 0) that is the path's alone.
float share_behind(float light2) {
    return path_even_distance2 > 0.0 ? eye_share(SHARES_PLANES ? light2 / path_evenness : light2, path_even_distance2) : 1.0;
}

// Weight of emission met by a direction of density pdf (0: not found by light sampling), which light sampling finds with light_pdf.
float emission_weight(float pdf, float light_pdf) { return pdf > 0.0 ? power_heuristic(pdf, light_pdf) : 1.0; }

// Density with which light sampling, where the path in a slot was scattered last, would have found the lamp that it has met.
float emitter_pdf(uint slot, WalkState path, Surface s, float t) {
    if (!HAS_LIGHT_TREE) {
        return triangle_light_pdf(LightReceiver(vec3(0.0), vec3(0.0)), s, path.direction, t);
    }
    // Emission that counts in full has no need of it.
    return path.pdf > 0.0 ? triangle_light_pdf(path_receivers[slot], s, path.direction, t) : 0.0;
}

// Shades the hit of the path in a slot. What it meets is added to `radiance`; `flags` say what waits at the place, and whether the path goes on.
void shade(uint slot, uint place, WalkState path, inout vec3 radiance, inout uint flags) {
    Hit hit = load_hit(place);
    uint state = 0u;
    if (HAS_PATH_AUTOMATON) {
        state = path_set_state(path.bounce);
        path.bounce = path_set_bounce(path.bounce);
    }
    bool counted = path_set_contains(push.path_set, path.bounce);
    counted = counted && (!HAS_PATH_AUTOMATON || (push.accepting >> state & 1u) != 0u);

    if (hit.triangle == NO_HIT) {
        if (HAS_ENVIRONMENT && counted) {
            SceneEnvironment e = load_environment();
            vec3 local = world_to_environment(e, path.direction);
            vec4 seen = environment_look_up(e, local);
            float weight = emission_weight(path.pdf, environment_choice_probability() * seen.a);
            if (SHARES) {
                weight *= share_behind(placeless_distance2(push.scene_lower, push.scene_upper));
            }
            radiance += path.throughput * seen.rgb * weight;
        }
        return;
    }

    Arrival a = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    Surface s = a.surface;
    SceneMaterial m = a.material;
    Bsdf bsdf = a.bsdf;
    uint around = HAS_MEDIA ? s.around : OUTSIDE;
    uint interior = arrival_interior(a, HAS_TRANSMISSION || HAS_MEDIA ? walk_gathered[slot].interior : OUTSIDE);
    if (!HAS_MEDIA) {
        path.throughput = absorbed(path.throughput, interior, hit.t);
    }

    if ((HAS_AREA_LIGHTS || HAS_UNLIT) && counted) {
        vec3 emission = surface_emission(m, s, a.wo);
        if (emission != vec3(0.0)) {
            float light_pdf = HAS_AREA_LIGHTS && s.light != NO_LIGHT ? emitter_pdf(slot, path, s, hit.t) : 0.0;
            float weight = emission_weight(path.pdf, light_pdf);
            // What sends no photons is the paths' alone.
            if (SHARES && HAS_AREA_LIGHTS && s.light != NO_LIGHT) {
                weight *= share_behind(hit.t * hit.t);
            }
            radiance += path.throughput * emission * weight;
        }
    }

    vec3 normal = arrival_normal(a);
    if (WRITE_AOVS && path.bounce == 0u) {
        vec3 albedo = bsdf_is_conductor(bsdf) ? conductor_average(bsdf) : bsdf.base_color;
        path_aovs[slot] = PathAov(albedo, hit.t, normal, 1u);
    }
    // Lobes after which the path may go on, and those after which light counts.
    uint mask = path_set_lobes(push.path_set);
    uint lit_mask = mask;
    uint successors = 0u;
    if (HAS_PATH_AUTOMATON) {
        successors = push.successors[state];
        mask = path_set_lobes_to(successors, PATH_SET_LIVE);
        lit_mask = path_set_lobes_to(successors, push.accepting);
    }
    // What is scattered here by other lobes than mirrors, of light that came over an edge whose other end scattered by such, is shared.
    float share = 1.0;
    if (EDGE_BOUND != EDGE_UNBOUNDED) {
        float cos_there = EDGE_BOUND == EDGE_GEOMETRY ? path_departures[slot] : 1.0;
        float cos_here = abs(dot(path.direction, s.geometric_normal));
        share = share_beyond(EDGE_BOUND, push.edge_bound, path.pdf, cos_there, cos_here, hit.t * hit.t);
        mask &= share > 0.0 ? LOBE_ALL : LOBE_SPECULAR;
        lit_mask &= mask;
    }
    bool ends = arrival_is_unlit(a) || !path_set_continues(push.path_set, path.bounce);
    ends = ends || (HAS_PATH_AUTOMATON && mask == 0u);
    if (ends) {
        return;
    }
    ScatteringFrame frame = scattering_frame(a, normal);
    uint bounce = path.bounce;
    count_quarters(NUMBERED ? 1u : 0u);

    // Through what transmits, light comes from the other side, too.
    bool transmits = HAS_TRANSMISSION && m.transmission > 0.0;
    LightReceiver receiver = LightReceiver(s.point.position, transmits ? vec3(0.0) : frame.z);
    bool lit = HAS_AREA_LIGHTS || HAS_ENVIRONMENT || HAS_PUNCTUAL_LIGHTS;
    lit = lit && (!HAS_PATH_AUTOMATON || lit_mask != 0u);
    if (lit && path_set_contains(push.path_set, bounce + 1u)) {
        uvec2 word = bounce_words(slot, bounce, DIMENSION_LIGHT);
        LightSample light = sample_light(receiver, word, push.scene_lower, push.scene_upper);
        vec3 wi = light.direction;
        if (light.radiance != vec3(0.0) && sides_agree(frame.z, frame.outward, wi)) {
            // The density is that of the directions sampled below, whatever part of them finds light that counts.
            vec4 f = bsdf_eval_part(bsdf, frame.wo, world_to_frame(frame, wi), mask, lit_mask);
            if (f.rgb != vec3(0.0)) {
                float weight = light.pdf > 0.0 ? power_heuristic(light.pdf, f.a) : 1.0;
                if (SHARES && path_even_distance2 != 0.0) {
                    vec3 to = light.point.position - s.point.position;
                    float light2 = light.infinite ? placeless_distance2(push.scene_lower, push.scene_upper) : dot(to, to);
                    weight *= eye_share(light2, abs(path_even_distance2));
                }
                ShadowRay ray_to_light;
                ray_to_light.slot = slot;
                ray_to_light.bounce = bounce + 1u;
                vec3 start = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, wi);
                ray_to_light.t_max = FAR_AWAY;
                ray_to_light.direction = wi;
                if (!light.infinite) {
                    ray_to_light.t_max = 1.0;
                    shadow_segment(s.point, s.geometric_normal, light.point, light.normal, start, ray_to_light.direction);
                }
                ray_to_light.origin = start;
                ray_to_light.contribution = path.throughput * light.radiance * f.rgb * (weight * share);
                uint passed = a.solid ? (dot(wi, frame.outward) < 0.0 ? s.material : around) : interior;
                if (!HAS_MEDIA && !light.infinite) {
                    float way = distance(s.point.position, light.point.position);
                    ray_to_light.contribution = absorbed(ray_to_light.contribution, passed, way);
                }
                float left_out = HAS_MEDIA ? way_left_out(s, start, wi) / length(ray_to_light.direction) : 0.0;
                flags |= store_shadow_ray(place, ray_to_light, passed, -left_out);
            }
        }
    }

    vec2 side = bounce_sample(slot, bounce, DIMENSION_SIDE);
    BsdfSample scattered = bsdf_sample(bsdf, frame.wo, vec3(bounce_sample(slot, bounce, DIMENSION_DIRECTION), side.x), mask);
    if (HAS_PATH_AUTOMATON) {
        uint after_base = path_set_successor(successors, LOBE_DIFFUSE & LOBE_REFLECTION);
        uint after_microfacets = path_set_successor(successors, LOBE_GLOSSY & LOBE_REFLECTION);
        bool alike = !HAS_LOBE_LABELS || after_base == after_microfacets;
        scattered = bsdf_label(bsdf, frame.wo, scattered, mask, alike, side.y);
        state = scattered.flags != 0u ? path_set_successor(successors, scattered.flags) : 0u;
    }
    vec3 wi = frame_to_world(frame, scattered.wi);
    path.throughput *= scattered.weight;
    if (EDGE_BOUND != EDGE_UNBOUNDED && scattered.pdf > 0.0) {
        path.throughput *= share;
    }
    if (scattered.flags == 0u || !sides_agree(frame.z, frame.outward, wi) || path.throughput == vec3(0.0)) {
        return;
    }
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u && (bsdf.flags & BSDF_THIN) == 0u) {
        float eta = frame.wo.z > 0.0 ? bsdf.eta : 1.0 / bsdf.eta;
        path.eta_scale *= eta * eta;
        walk_gathered[slot].interior = frame.wo.z > 0.0 ? s.material : around;
    }
    path.bounce = bounce + 1u;
    if (!path_roulette(path, side.y)) {
        return;
    }
    path.origin = departure(a, wi, path.throughput);
    path.direction = normalize(wi);
    path.pdf = scattered.pdf;
    if (HAS_LIGHT_TREE) {
        path_receivers[slot] = receiver;
    }
    if (EDGE_BOUND == EDGE_GEOMETRY) {
        path_departures[slot] = abs(dot(path.direction, s.geometric_normal));
    }
    if (SHARES) {
        path_even_distances[slot] = abs(path_even_distance2);
    }
    if (SHARES_PLANES) {
        path_flights[slot].evenness = 1.0;
    }
    if (HAS_PATH_AUTOMATON) {
        path.bounce = path_set_joined(path.bounce, state);
    }
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
    count_quarters(HAS_TRANSMISSION ? WALK_STATE_QUARTERS : WALK_STATE_QUARTERS - 1u);
    WalkState path = load_walk(slot);
    if (!HAS_TRANSMISSION) {
        // Nothing has refracted: what would say so is not read.
        path.eta_scale = 1.0;
    }
    if (HAS_MEDIA) {
        MediumEvent event = walk_medium_events[place];
        if ((event.flags & EVENT_HANDLED) != 0u) {
            add_fetches(FETCHES_SHADE);
            return;
        }
        flags = (event.flags & FLAG_AIRLIGHT) != 0u ? FLAG_AIRLIGHT | FLAG_WAITING : 0u;
        path.throughput *= event.weight;
    }
    if (SHARES) {
        path_even_distance2 = path_even_distances[slot];
    }
    if (SHARES_PLANES) {
        path_evenness = path_flights[slot].evenness;
    }
    shade(slot, place, path, radiance, flags);
    if (radiance != vec3(0.0)) {
        walk_gathered[slot].radiance += radiance;
    }
    walk_flags_out[place] = flags;
    add_fetches(FETCHES_SHADE);
}
