#version 460
// Eye subpaths on their ways through media: free flight to a collision, where a light is sampled, weighted against all other ways to make the path, and a direction chosen; on through a
// boundary; or with what is left of the throughput to the surface, for bdpt_shade.comp. What media emit on the way is found in no other way and counts in full.
//
// Weights have the phase function's density and the squared distance of a collision, and no cosine. Of the flight they have nothing: every way to make a path samples the distances of
// its collisions alike, but for the edge that is joined (bdpt_mis.glsl). bdpt_medium_connect.comp joins collisions to light subpaths before.
//
// CL-BDPT-MEDIA: E. Lafortune and Y. Willems, "Rendering Participating Media with Bidirectional Path Tracing", 1996. Unbiased. Deterministic in (seed, pixel, sample).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/bidirectional/bdpt_media_set.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "walk/hand_on.glsl"
#include "techniques/bidirectional/bdpt_lights.glsl"

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
    uint surrounding;     // index of the medium outside all bodies, or NO_MEDIUM
} push;

#include "techniques/bidirectional/bdpt_eye.glsl"
#include "techniques/bidirectional/bdpt_strategy.glsl"
#include "techniques/path/path_roulette.glsl"
#include "walk/draws.glsl"
#include "transport/phase.glsl"
#include "walk/flight.glsl"

// Light that the path in a slot scatters at a collision `at`. The flags of the place where there is some, or 0.
uint sample_light_at(uint slot, uint place, WalkState path, SceneMedium m, uint interior, vec3 at, PartialWeights weights) {
    float emitted;
    LightSample light = sample_emission(at, bounce_words(slot, path.bounce, DIMENSION_LIGHT), push.disk_pdf, push.scene_lower, push.scene_upper, emitted);
    float phase = phase_function(m.phase, m.phase_parameter, path.direction, light.direction);
    // A light without extent is met by no path.
    float met = light.pdf > 0.0 ? phase / light.pdf : 0.0;
    float weight = strategy_weight(STRATEGY_LIGHT_SAMPLES, met, emitted * mis_behind(weights, phase));
    if (light.radiance == vec3(0.0) || !(weight > 0.0)) {
        return 0u;
    }
    ShadowRay ray;
    ray.slot = slot;
    ray.bounce = path.bounce + 1u;
    ray.contribution = path.throughput * light.radiance * (phase * weight);
    ray.origin = at;
    ray.t_max = FAR_AWAY;
    ray.direction = light.direction;
    if (!light.infinite) {
        ray.t_max = 1.0;
        shadow_segment(SurfacePoint(at, vec3(0.0)), vec3(0.0), light.point, light.normal, ray.origin, ray.direction);
    }
    return store_shadow_ray(place, ray, interior, 0.0);
}

// The path's new direction at a collision; false when it ends.
bool scatter(uint slot, SceneMedium m, vec3 at, PartialWeights weights, inout WalkState path) {
    float roulette = bounce_sample(slot, path.bounce, DIMENSION_SIDE).y;
    vec2 u = bounce_sample(slot, path.bounce, DIMENSION_DIRECTION);
    float c = phase_function_sample(m.phase, m.phase_parameter, u.x);
    vec3 wi = normalize(phase_direction(path.direction, c, u.y));
    path.pdf = phase_function(m.phase, m.phase_parameter, path.direction, wi);
    // Phase functions are the same both ways.
    subpath_weights[slot] = mis_scatter(weights, 1.0, path.pdf, path.pdf);
    path.origin = at;
    path.direction = wi;
    path.bounce += 1u;
    return path_roulette(path, roulette);
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count || !takes_flight(place)) {
        return;
    }
    uint slot = load_slot(place);
    WalkState path = load_walk(slot);
    uint path_state = take_path_state(path);
    MediumState state = medium_state(slot);
    Hit hit = load_hit(place);
    bool shows = STRATEGY == STRATEGY_COMBINED || STRATEGY == STRATEGY_EMISSION;
    shows = shows && counts(path.bounce) && state_accepts(path_state);
    uint behind = state_behind(path_state, LOBE_VOLUME);
    Flight f = fly(slot, path, hit, push.surrounding, path.bounce < push.most_bounces && behind != PATH_SET_DEAD, shows ? path.throughput : vec3(0.0), state);
    count_flight(f);
    if (f.emitted != vec3(0.0)) {
        walk_gathered[slot].radiance += f.emitted;
    }
    state.bands = f.bands;
    bool handled = true;
    bool alive = false;
    uint flags = 0u;
    uint interior = f.crossing.interior;
    vec3 arrived = path.throughput * f.weight;
    if (f.outcome == GRID_COLLIDED) {
        path.throughput = arrived;
        if (arrived != vec3(0.0)) {
            SceneMedium m = load_medium(f.medium);
            PartialWeights weights = eye_weights_under(slot, path, 1.0, f.t);
            vec3 at = path.origin + f.t * path.direction;
            if (HAS_LIGHTS && counts(path.bounce + 1u) && state_accepts(behind)) {
                flags = sample_light_at(slot, place, path, m, interior, at, weights);
            }
            alive = scatter(slot, m, at, weights, path);
            path_state = behind;
            state.start = 0.0;
        }
    } else if (f.outcome == GRID_STOPPED) {
        path.throughput = arrived;
        state.start = f.t;
        alive = arrived != vec3(0.0);
    } else if (f.crossing.boundary) {
        path.throughput = arrived;
        state.start = past_surface(hit.t);
        interior = f.crossing.beyond;
        alive = arrived != vec3(0.0);
    } else {
        handled = false;
    }
    walk_gathered[slot].interior = interior;
    walk_medium_states[slot] = state;
    walk_medium_events[place] = MediumEvent(f.weight, handled ? EVENT_HANDLED : 0u);
    if (handled) {
        walk_flags_out[place] = flags | (alive ? FLAG_ALIVE : 0u);
        if (alive) {
            put_path_state(path, path_state);
            walk_states_out[slot] = path;
        }
    }
}
