// What the stages of a bounce have in common: push constants.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_BOUNCE_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_BOUNCE_GLSL

#include "walk/wave.glsl"

layout(constant_id = 28) const bool NUMBERED = false;  // each slot has a pixel and sample of its own: adaptive samples, or a wave that is kept full
#define CLERESTORY_NUMBERED NUMBERED

// Photons of a pass that have a share of the light that paths scatter further behind their first scattering in a medium (transport/photon_share.glsl); 0: none has.
layout(constant_id = 50) const uint SHARING_PHOTONS = 0u;
const bool SHARES = SHARING_PHOTONS != 0u;
// These have planes: paths share the light of planes by the areas that stand for these, and all other by those of beams.
layout(constant_id = 51) const bool SHARES_PLANES = false;

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint path_set;          // PathSet, packed
    vec3 scene_upper;
    float roulette_cap;     // largest probability to go on
    WalkKey key;            // sequences are pixels, places in them samples
    uint roulette_start;    // first bounce at which Russian roulette may end a path
    uint surrounding;       // index of the medium outside all bodies, or NO_MEDIUM
    uint accepting;         // states of the automaton in which light counts, a bit each
    uint successors[15];    // of each state
    float edge_bound;       // of EDGE_BOUND, beyond which paths have the light of an edge. Beside SHARES no edge is bounded: of SHARES_PLANES the share of ways that have planes, else the radius of collisions
    float beam_radius;      // of SHARES, within which beams are seen
} push;

#include "techniques/path/path_roulette.glsl"

#endif
