#version 460
// Walks from the lights on their ways through media: free flight to a collision, which waits as a virtual light and is scattered, or absorbed; on through a
// boundary; or with what is left of the power to the surface, for photon_scatter.comp.
//
// Free flights are those of walk/flight.glsl. A collision keeps the power that it scatters; the walk goes on with the
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
#include "transport/phase.glsl"
#include "walk/flight.glsl"
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
    if (status.stalled != STALLED_NOT || place >= status.active_count || !takes_flight(place)) {
        return;
    }
    uint slot = load_slot(place);
    WalkState walk = load_walk(slot);
    uint bounce = path_set_bounce(walk.bounce);
    MediumState state = medium_state(slot);
    Hit hit = load_hit(place);
    Flight f = fly(slot, walk, hit, push.surrounding, true, vec3(0.0), state);
    count_flight(f);
    state.bands = f.bands;
    bool handled = true;
    bool alive = false;
    uint flags = 0u;
    uint interior = f.crossing.interior;
    vec3 before = walk.throughput;
    walk.throughput *= f.weight;
    if (f.outcome == GRID_COLLIDED) {
        if (walk.throughput != vec3(0.0)) {
            vec3 at = walk.origin + f.t * walk.direction;
            if (bounce >= push.first_deposit) {
                flags = deposit_collision(place, walk, at, f.medium, bounce);
            }
            alive = scatter(slot, load_medium(f.medium), before, at, bounce, walk);
            state.start = 0.0;
        }
    } else if (f.outcome == GRID_STOPPED) {
        state.start = f.t;
        alive = walk.throughput != vec3(0.0);
    } else if (f.crossing.boundary) {
        state.start = past_surface(hit.t);
        interior = f.crossing.beyond;
        alive = walk.throughput != vec3(0.0);
    } else {
        handled = false;
    }
    walk_gathered[slot].interior = interior;
    walk_medium_states[slot] = state;
    walk_medium_events[place] = MediumEvent(f.weight, handled ? EVENT_HANDLED : 0u);
    if (handled) {
        walk_flags_out[place] = flags | (alive ? FLAG_ALIVE : 0u);
        if (alive) {
            walk_states_out[slot] = walk;
        } else {
            atomicAdd(collision_counters.absorbed, 1u);
        }
    }
}
