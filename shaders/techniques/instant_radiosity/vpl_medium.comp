#version 460
// Walks from the lights on their ways through media: free flight to a collision, which waits as a virtual light and is scattered, or absorbed; on through a
// boundary; or with what is left of the power to the surface, for photon_scatter.comp.
//
// Free flights are those of eye paths (transport/medium.glsl, transport/media_tracking.glsl): analytic in homogeneous media, delta tracking in grids, one walk for all bands. A collision keeps the power that it scatters; the walk goes on with the
// probability that leaves its largest band as it is. Where a medium scatters nothing there are no collisions, and power is weighted by the transmittance instead.
//
// CL-VPL-MEDIA: A. Keller, "Instant Radiosity", 1997, in media. Deterministic in (seed, pass, walk).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/photon_mapping/photon_history.glsl"
#include "transport/path_set.glsl"
#include "walk/media.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    WalkKey key;         // the sequence is the pass, places in it walks
    uint surrounding;    // index of the medium outside all bodies, or NO_MEDIUM
    uint last_bounce;    // greatest number of scatterings before a collision that is kept
    uint first_deposit;  // least
} push;

layout(set = 1, binding = 0, scalar) restrict buffer CollisionCounters {
    uint absorbed;  // walks that end in a medium or at its boundary: by roulette, after the last bounce, or without power
    uint kept;      // collisions that became virtual lights
} collision_counters;

#include "walk/draws.glsl"
#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "transport/phase.glsl"
#include "walk/survival.glsl"

// What a virtual light at a collision is made of (vpl_medium_append.comp).
uint deposit_collision(uint place, WalkState walk, vec3 at, uint medium, uint bounce) {
    atomicAdd(collision_counters.kept, 1u);
    store_waiting(place, uvec4(floatBitsToUint(at), bounce), uvec4(floatBitsToUint(walk.throughput), medium + 1u),
                  uvec4(floatBitsToUint(walk.direction), 0u));
    return FLAG_WAITING;
}

// The walk's new direction at a collision, which has left `walk.throughput` of what there was `before`; false when it ends.
bool scatter(uint slot, SceneMedium m, vec3 before, vec3 at, uint bounce, inout WalkState walk) {
    if (bounce >= push.last_bounce) {
        return false;
    }
    float survival = walk_survival(before, walk.throughput, bounce);
    // Also ends a walk whose power is not a number.
    if (!(bounce_sample(slot, bounce, DIMENSION_SIDE).y < survival)) {
        return false;
    }
    vec2 u = bounce_sample(slot, bounce, DIMENSION_DIRECTION);
    float c = phase_function_sample(m.phase, m.phase_parameter, u.x);
    walk.direction = normalize(phase_direction(walk.direction, c, u.y));
    walk.origin = at;
    walk.throughput /= survival;
    walk.bounce = path_set_joined(bounce + 1u, PHOTON_DIFFUSED);
    return true;
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    if (HAS_GRIDS) {
        if (walk_resume[place] == PLACE_SCATTERED) {
            return;
        }
        if (!has_work_left()) {
            leave_for_later(STALLED_SCATTER);
            return;
        }
        walk_resume[place] = PLACE_SCATTERED;
    }
    uint slot = load_slot(place);
    WalkState walk = load_walk(slot);
    uint bounce = path_set_bounce(walk.bounce);
    MediumState state = MediumState(vec3(1.0 / 3.0), 0.0);
    if (status.rounds > 0u) {
        state = walk_medium_states[slot];
    }
    Hit hit = load_hit(place);
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, walk.direction, walk_gathered[slot].interior);
    }
    float end = hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, state.start);
    uint medium = medium_inside(crossing.interior, push.surrounding);
    vec3 weight = vec3(1.0);
    uint outcome = GRID_LEFT;
    SceneMedium m;
    float t = 0.0;  // of a collision, or of a stop, along the ray
    if (medium != NO_MEDIUM && end > state.start) {
        m = load_medium(medium);
        bool passes = m.sigma_s == vec3(0.0);
        uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            float t_max = end >= FAR_AWAY ? FAR_AWAY : end - state.start;
            if (passes) {
                weight = transmittance(m.sigma_t, t_max);
            } else {
                Sampler s = walk_sampler(slot, dimension);
                FreeFlight flight = sample_free_flight(m.sigma_s, m.sigma_t, state.bands, t_max, sample_2d(s));
                weight = flight.weight;
                state.bands = flight.bands;
                outcome = flight.collides ? GRID_COLLIDED : GRID_LEFT;
                t = state.start + flight.t;
            }
        } else if (HAS_GRIDS) {
            uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
            GridWalk grid = begin_grid_walk(m, walk.origin, walk.direction, state.start, end);
            vec3 emitted = vec3(0.0);
            outcome = delta_tracking(m, key, vec3(0.0), passes, grid, state.bands, weight, emitted);
            t = grid.entry + grid.t;
            float reached = resumed_start(state.start, t);
            // The search that goes on from the surface itself would miss it.
            outcome = outcome == GRID_STOPPED && reached >= end ? GRID_LEFT : outcome;
            t = outcome == GRID_STOPPED ? reached : t;
            COUNT_MEDIUM(null_collisions, grid.nulls)
            COUNT_MEDIUM(density_lookups, grid.nulls + (outcome == GRID_COLLIDED ? 1u : 0u))
            count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
        }
        COUNT_MEDIUM(collisions, outcome == GRID_COLLIDED ? 1u : 0u)
    }
    if (HAS_ABSORPTION && crossing.interior != OUTSIDE && outcome == GRID_LEFT) {
        weight *= exp(-load_material(crossing.interior).absorption * (end - max(state.start, 0.0)));
    }
    bool handled = true;
    bool alive = false;
    uint flags = 0u;
    uint interior = crossing.interior;
    vec3 before = walk.throughput;
    walk.throughput *= weight;
    if (outcome == GRID_COLLIDED) {
        if (walk.throughput != vec3(0.0)) {
            // What lies before the ray's origin is moved there, so that it stays on the right side of the surface that the ray left.
            vec3 at = walk.origin + max(t, 0.0) * walk.direction;
            if (bounce >= push.first_deposit) {
                flags = deposit_collision(place, walk, at, medium, bounce);
            }
            alive = scatter(slot, m, before, at, bounce, walk);
            state.start = 0.0;
        }
    } else if (outcome == GRID_STOPPED) {
        state.start = t;
        alive = walk.throughput != vec3(0.0);
    } else if (crossing.boundary) {
        state.start = past_surface(hit.t);
        interior = crossing.beyond;
        alive = walk.throughput != vec3(0.0);
    } else {
        handled = false;
    }
    walk_gathered[slot].interior = interior;
    walk_medium_states[slot] = state;
    walk_medium_events[place] = MediumEvent(weight, handled ? EVENT_HANDLED : 0u);
    if (handled) {
        walk_flags_out[place] = flags | (alive ? FLAG_ALIVE : 0u);
        if (alive) {
            walk_states_out[slot] = walk;
        } else {
            atomicAdd(collision_counters.absorbed, 1u);
        }
    }
}
