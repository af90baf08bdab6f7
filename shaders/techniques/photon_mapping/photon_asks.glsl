// Which eye paths ask the photon map where they have arrived: one decision, for queries and for the queues of them.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_ASKS_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_ASKS_GLSL

#include "transport/path_features.glsl"
#include "transport/arrival.glsl"
#include "transport/path_buffers.glsl"
#include "transport/path_set.glsl"

layout(constant_id = 44) const bool COUNTS_BOUNCES = false;  // the path set bounds the number of scatterings

struct AskSettings {
    vec3 scene_lower;
    uint states;        // of a path whose diffuse surfaces ask, a bit each
    vec3 scene_upper;
    uint most_bounces;  // scatterings in all, with that at the point
};

// How often the path has been scattered, and the state of its automaton.
uint asking_bounce(PathState path) { return HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce; }
uint asking_state(PathState path) { return HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u; }

// Whether the path at a place asks; where it has arrived, if so.
bool asks_map(AskSettings ask, PathState path, uint place, out Arrival arrival) {
    Hit hit = load_hit(place);
    if ((ask.states >> asking_state(path) & 1u) == 0u || hit.triangle == NO_HIT) {
        return false;
    }
    if (COUNTS_BOUNCES && asking_bounce(path) + 1u > ask.most_bounces) {
        return false;
    }
    arrival = arrival_at(hit, path.direction, ask.scene_lower, ask.scene_upper);
    return !arrival_is_unlit(arrival) && arrival_has_diffuse_base(arrival);
}

// Whether a wave has arrived at all: no ray of it was stopped.
bool wave_has_arrived() { return status.stalled != STALLED_EXTEND && status.stalled != STALLED_SHADOW; }

#endif
