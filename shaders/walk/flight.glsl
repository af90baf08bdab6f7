// A walk's ray on its way through media: to a collision, to where a walk through a grid is stopped, or to the surface that it has met.
//
// BG-4: analytic free flight in homogeneous media and delta tracking in grids, one walk for all bands (transport/medium.glsl, transport/media_tracking.glsl). Where nothing is
// scattered there are no collisions, and light is weighed by the transmittance instead. A walk of a slot and a round has one flight, whichever kernel asks for it.
// Some kernels have flights of their own: path_medium.comp also samples the way by the angle under which a light sees it, from the segment and the grid's walk that it flies through, and ends
// ways through grids where such samples end; vpl_medium_gather.comp ends them there, too, to follow the same paths; photon_medium.comp stores whole ways, and footprints that need the
// density of a collision.
// Expects walk/draws.glsl, the media of scene/media.glsl, and the constants of transport/features.glsl and transport/media_features.glsl.
#ifndef CLERESTORY_WALK_FLIGHT_GLSL
#define CLERESTORY_WALK_FLIGHT_GLSL

#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "walk/media.glsl"
#include "walk/wave.glsl"

struct Flight {
    uint outcome;       // GRID_COLLIDED, GRID_STOPPED, or GRID_LEFT for one that has come to the surface
    float t;            // of the collision or the stop, along the ray
    vec3 weight;        // of the throughput on the way there, with the scattering coefficient of a collision
    vec3 bands;         // as in transport/medium.glsl, there
    vec3 emitted;       // by the medium on the way, as seen through the throughput
    Crossing crossing;  // of the surface
    uint medium;        // that the way was in, or NO_MEDIUM
    uint nulls;         // tentative collisions that were none
};

// How a walk's way through media stands: at its start, or as the stage that let it go on has left it.
MediumState medium_state(uint slot) {
    if (status.rounds > 0u) {
        return walk_medium_states[slot];
    }
    return MediumState(vec3(1.0 / 3.0), 0.0);
}

// The flight of a walk in a slot to what it has met, from a state. `scatters` says whether collisions are wanted, and `seen` is the throughput through which emission is seen, or 0.
Flight fly(uint slot, WalkState walk, Hit hit, uint surrounding, bool scatters, vec3 seen, MediumState state) {
    Flight f = Flight(GRID_LEFT, 0.0, vec3(1.0), state.bands, vec3(0.0), Crossing(OUTSIDE, OUTSIDE, false), NO_MEDIUM, 0u);
    if (hit.triangle != NO_HIT) {
        f.crossing = cross_surface(hit.triangle, walk.direction, walk_gathered[slot].interior);
    }
    float end = hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, state.start);
    f.medium = medium_inside(f.crossing.interior, surrounding);
    if (f.medium != NO_MEDIUM && end > state.start) {
        SceneMedium m = load_medium(f.medium);
        bool passes = !scatters || m.sigma_s == vec3(0.0);
        // Draws of media are numbered by the walk's round, which is the number of its ways so far.
        uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            float t_max = end >= FAR_AWAY ? FAR_AWAY : end - state.start;
            if (seen != vec3(0.0) && m.emission != vec3(0.0)) {
                f.emitted = seen * m.emission * vec3(attenuated_length(m.sigma_t.x, t_max), attenuated_length(m.sigma_t.y, t_max),
                                                     attenuated_length(m.sigma_t.z, t_max));
            }
            if (passes) {
                f.weight = transmittance(m.sigma_t, t_max);
            } else {
                Sampler s = walk_sampler(slot, dimension);
                FreeFlight flight = sample_free_flight(m.sigma_s, m.sigma_t, f.bands, t_max, sample_2d(s));
                f.weight = flight.weight;
                f.bands = flight.bands;
                f.outcome = flight.collides ? GRID_COLLIDED : GRID_LEFT;
                f.t = state.start + flight.t;
            }
        } else if (HAS_GRIDS) {
            uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
            GridWalk grid = begin_grid_walk(m, walk.origin, walk.direction, state.start, end);
            f.outcome = delta_tracking(m, key, seen, passes, grid, f.bands, f.weight, f.emitted);
            f.t = grid.entry + grid.t;
            float reached = resumed_start(state.start, f.t);
            // The search that goes on from the surface itself would miss it.
            f.outcome = f.outcome == GRID_STOPPED && reached >= end ? GRID_LEFT : f.outcome;
            f.t = f.outcome == GRID_STOPPED ? reached : f.t;
            f.nulls = grid.nulls;
        }
    }
    // What lies before the ray's origin is moved there, so that it stays on the right side of the surface that the ray left.
    f.t = f.outcome == GRID_COLLIDED ? max(f.t, 0.0) : f.t;
    if (HAS_ABSORPTION && f.crossing.interior != OUTSIDE && f.outcome == GRID_LEFT) {
        f.weight *= exp(-load_material(f.crossing.interior).absorption * (end - max(state.start, 0.0)));
    }
    return f;
}

// Counts a flight, in the stage that goes on with it.
void count_flight(Flight f) {
    COUNT_MEDIUM(collisions, f.outcome == GRID_COLLIDED ? 1u : 0u)
    if (HAS_GRIDS) {
        COUNT_MEDIUM(null_collisions, f.nulls)
        COUNT_MEDIUM(density_lookups, f.nulls + (f.outcome == GRID_COLLIDED ? 1u : 0u))
        count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
    }
}

// Whether a stage of flights takes a place: not one that it has handled before it stalled elsewhere, nor one that is left for later, since the submission's work is used up.
bool takes_flight(uint place) {
    if (!HAS_GRIDS) {
        return true;
    }
    if (walk_resume[place] == PLACE_SCATTERED) {
        return false;
    }
    if (!has_work_left()) {
        leave_for_later(STALLED_SCATTER);
        return false;
    }
    walk_resume[place] = PLACE_SCATTERED;
    return true;
}

#endif
