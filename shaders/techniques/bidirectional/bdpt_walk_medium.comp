#version 460
// Light subpaths on their ways through media: free flight to a collision, which is a vertex that others may be joined to, and is scattered, or absorbed; on through a boundary; or
// with what is left of the power to the surface, for bdpt_scatter.comp.
//
// Weights have the phase function's density and the squared distance of a collision, and no cosine. Of the flight they have nothing: every way to make a path samples the distances of
// its collisions alike, but for the edge that is joined (bdpt_mis.glsl).
//
// CL-BDPT-MEDIA: E. Lafortune and Y. Willems, "Rendering Participating Media with Bidirectional Path Tracing", 1996. Deterministic in (seed, pass, walk).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/bidirectional/bdpt_media_set.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "techniques/bidirectional/bdpt_new_vertex.glsl"

layout(push_constant, scalar) uniform Push {
    WalkKey key;       // the sequence is the pass, places in it walks
    uint surrounding;  // index of the medium outside all bodies, or NO_MEDIUM
    uint last_bounce;  // greatest number of scatterings before a vertex
    uint group;        // walks of one
} push;

#include "walk/draws.glsl"
#include "transport/phase.glsl"
#include "walk/flight.glsl"
#include "walk/survival.glsl"

// Leaves a vertex where the walk of a slot collides with a medium, which has left `walk.throughput` of what there was `before`, and scatters it there; true when it goes on.
bool collide(uint slot, uint place, Flight f, vec3 before, inout WalkState walk, inout uint flags) {
    // States in which a path that comes from the eye may be scattered here.
    uint states = states_before(walk_states(walk), LOBE_VOLUME);
    bool from_infinity = walk.bounce == 0u && walk.pdf > 0.0;
    PartialWeights weights = mis_arrive(subpath_weights[slot], from_infinity ? 1.0 : f.t * f.t, 1.0);
    vec3 at = walk.origin + f.t * walk.direction;
    uint history = pack_history(walk.bounce, walk_index(slot) / push.group, walk_states(walk));
    store_light_vertex(place, floatBitsToUint(at), f.medium, history, walk, weights);
    flags |= FLAG_WAITING;
    if (walk.bounce >= push.last_bounce) {
        return false;
    }
    float survival = walk_survival(before, walk.throughput, walk.bounce);
    // Also ends a walk whose power is not a number.
    if (!(bounce_sample(slot, walk.bounce, DIMENSION_SIDE).y < survival)) {
        return false;
    }
    SceneMedium m = load_medium(f.medium);
    vec2 u = bounce_sample(slot, walk.bounce, DIMENSION_DIRECTION);
    float c = phase_function_sample(m.phase, m.phase_parameter, u.x);
    vec3 wi = normalize(phase_direction(walk.direction, c, u.y));
    float phase = phase_function(m.phase, m.phase_parameter, walk.direction, wi);
    // Phase functions are the same both ways.
    subpath_weights[slot] = mis_scatter(weights, 1.0, phase, phase);
    walk.direction = wi;
    walk.origin = at;
    walk.throughput /= survival;
    walk.bounce += 1u;
    walk.pdf = 0.0;
    walk.eta_scale = states_of_walk(states);
    return true;
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count || !takes_flight(place)) {
        return;
    }
    uint slot = load_slot(place);
    WalkState walk = load_walk(slot);
    MediumState state = medium_state(slot);
    Hit hit = load_hit(place);
    // Where collisions are of no use to any path of the set, light is weighed by the transmittance instead.
    bool scatters = states_before(walk_states(walk), LOBE_VOLUME) != 0u;
    Flight f = fly(slot, walk, hit, push.surrounding, scatters, vec3(0.0), state);
    count_flight(f);
    state.bands = f.bands;
    bool handled = true;
    bool alive = false;
    uint flags = 0u;
    uint interior = f.crossing.interior;
    vec3 before = walk.throughput;
    walk.throughput *= f.weight;
    bool carries = walk.throughput != vec3(0.0);
    if (f.outcome == GRID_COLLIDED) {
        alive = carries && collide(slot, place, f, before, walk, flags);
        state.start = 0.0;
    } else if (f.outcome == GRID_STOPPED) {
        state.start = f.t;
        alive = carries;
    } else if (f.crossing.boundary) {
        state.start = past_surface(hit.t);
        interior = f.crossing.beyond;
        alive = carries;
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
        }
    }
}
