// What queries of the maps know of the eye path that asks. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EYE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EYE_GLSL

#include "techniques/photon_mapping/photon_query_state.glsl"
#include "transport/path_set.glsl"
#include "walk/wave.glsl"

layout(constant_id = 44) const bool COUNTS_BOUNCES = false;  // the path set bounds the number of scatterings

// States of a path that may ask where the path set is an expression.
const uint ASKING_STATES = 7u;
const uint CLASSES_ON_SURFACES = 0xFFFFu;
const uint CLASSES_IN_MEDIA_SHIFT = 16u;

// How often the path has been scattered, and the state of its automaton.
uint asking_bounce(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce; }
uint asking_state(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u; }

// Whether a wave has arrived at all: no ray of it was stopped.
bool wave_has_arrived() { return status.stalled != STALLED_EXTEND && status.stalled != STALLED_SHADOW; }


// The way of an eye path through the medium before the surface that it has met, by place.
struct BeamWay {
    vec3 surface;   // what is left of light from there, or where a walk through a grid is
    float start;    // of the part that has not been asked for, along the ray
    float end;      // of the part, or of the walk so far
    // In a grid:
    float reach;    // from where on nothing is left of light, along the ray, or FAR_AWAY
    uint steps;     // of the walk
    float entry;    // where its table begins, along the ray
    float spacing;  // of the table's places
};

#endif
