// Places where eye paths have arrived and gather from the virtual lights of a pass: what kernels of such places are told, what they read and keep, and the point
// itself as a receiver.
//
// Expects transport/features.glsl, walk/wave.glsl and transport/path_set.glsl, and the constants that connection.glsl expects.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_GATHER_PLACE_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_GATHER_PLACE_GLSL

// Which lights send a place shadow rays.
const uint SELECT_ALL = 0u;
const uint SELECT_POTENTIAL = 1u;  // those that carry a share of the potential
const uint SELECT_CUTS = 2u;       // one below each node of a cut

// Candidates below a node of a cut at most.
const uint CUT_CANDIDATES_MAX = 8u;

layout(constant_id = 46) const uint SELECTION = SELECT_ALL;
layout(constant_id = 45) const uint LIGHTS_AT_ONCE = 1u;  // of a place, in a dispatch

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint states;          // of a path whose rough surfaces gather, a bit each
    vec3 scene_upper;
    uint least_bounces;   // scatterings in all
    uint most_bounces;
    uint lights;
    float scale;          // one over the walks of the pass
    float edge_bound;     // of EDGE_BOUND
    uint seed;            // of the pass
    uint first_place;
    uint goes_on;         // 1 for places that have stopped
    float geometry_most;  // geometry term that EDGE_BOUND leaves at most, 1/m2
    float share;          // of SELECT_POTENTIAL: what the lights that are taken carry of the sum of all potentials
    uint rescales;        // of SELECT_POTENTIAL: 1 where what they bring stands for all
    uint cut_size;        // of SELECT_CUTS: nodes of a cut at most
    uint candidates;      // of SELECT_CUTS: lights below a node that one is kept of
    uint first_selected;  // of SELECT_POTENTIAL: word behind the states of all places
} push;

// descriptor set 3: VirtualLightSet

layout(set = 3, binding = 0) uniform utextureBuffer virtual_light_texels;

#include "techniques/instant_radiosity/connection.glsl"
#include "techniques/instant_radiosity/gather_progress.glsl"

layout(set = 3, binding = 1, scalar) restrict buffer VirtualLightStates { GatherState gather_states[]; };  // by place
layout(set = 3, binding = 3, scalar) restrict readonly buffer LightDepartures { float departures[]; };  // path_departures, by slot
layout(set = 3, binding = 4) uniform utextureBuffer light_node_texels;                                  // of SELECT_CUTS: the tree of lights
// Of SELECT_POTENTIAL, from first_selected on, behind the states in the same buffer: the least potential that a place takes, and its rescaling.
layout(set = 3, binding = 5, scalar) restrict buffer SelectedLights { float selected_lights[]; };

uint arriving_bounce(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce; }
uint arriving_state(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u; }

// Prepares the receiver of a place; false where nothing is gathered.
bool begin_receiver(uint slot, uint place, out Receiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    r.bounce = arriving_bounce(path);
    // A light and the receiver scatter once more each.
    if ((push.states >> arriving_state(path) & 1u) == 0u || hit.triangle == NO_HIT || (COUNTS_BOUNCES && r.bounce + 2u > push.most_bounces)) {
        return false;
    }
    r.arrival = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(r.arrival) || !arrival_has_rough_lobes(r.arrival)) {
        return false;
    }
    r.interior = arrival_interior(r.arrival, HAS_TRANSMISSION ? walk_gathered[slot].interior : OUTSIDE);
    r.throughput = absorbed(path.throughput, r.interior, hit.t);
    if (EDGE_BOUND != EDGE_UNBOUNDED) {
        // The path has come over an edge of whose light virtual lights bring what its bound leaves.
        float cos_there = EDGE_BOUND == EDGE_GEOMETRY ? departures[slot] : 1.0;
        float cos_here = abs(dot(path.direction, r.arrival.surface.geometric_normal));
        r.throughput *= share_beyond(EDGE_BOUND, push.edge_bound, path.pdf, cos_there, cos_here, hit.t * hit.t);
    }
    r.frame = scattering_frame(r.arrival, arrival_normal(r.arrival));
    return r.throughput != vec3(0.0);
}

#endif
