// What queries of the maps know of the eye path that asks. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EYE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EYE_GLSL

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

// Stand in walk_resume for a query that its quota stopped, and for a place that has none or is done. In scenes with media a place has two: the beam through
// the media on the way there comes first.
const uint GATHER_STOPPED = 0xFFFFFFFEu;
const uint GATHER_DONE = 0xFFFFFFFCu;
const uint BEAM_DONE = 0xFFFFFFFBu;
const uint BEAM_STOPPED = 0xFFFFFFFAu;
const uint BEAM_STOPPED_GATHER_DONE = 0xFFFFFFF9u;
const uint BEAM_STOPPED_GATHER_STOPPED = 0xFFFFFFF8u;
// The walk through a grid that comes before a beam goes on in a later dispatch.
const uint BEAM_WALKING = 0xFFFFFFF7u;

// Whether the beam of a place has been asked for, whatever has become of it.
bool beam_is_known(uint resume) { return resume == BEAM_DONE || resume == BEAM_STOPPED; }
bool beam_has_stopped(uint resume) {
    return resume == BEAM_STOPPED || resume == BEAM_STOPPED_GATHER_DONE || resume == BEAM_STOPPED_GATHER_STOPPED;
}
bool gather_has_stopped(uint resume) { return resume == GATHER_STOPPED || resume == BEAM_STOPPED_GATHER_STOPPED; }

// What stands there for a point's query that is done, or stopped, by what stood there for the beam.
uint gather_done(uint resume) { return resume == BEAM_STOPPED ? BEAM_STOPPED_GATHER_DONE : GATHER_DONE; }
uint gather_stopped(uint resume) {
    return resume == BEAM_STOPPED || resume == BEAM_STOPPED_GATHER_DONE ? BEAM_STOPPED_GATHER_STOPPED : GATHER_STOPPED;
}

// The way of an eye path through the medium before the surface that it has met, by place.
struct BeamWay {
    vec3 surface;  // what is left of light from there
    float start;   // of the part that has not been asked for, along the ray
    vec3 reach;    // in a grid, how far light of each band comes, along the ray, or FAR_AWAY
    float end;     // of the part, or of the walk so far
};

#endif
