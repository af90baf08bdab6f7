// What the stages of a bounce have in common: push constants, and Russian roulette.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_BOUNCE_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_BOUNCE_GLSL

#include "walk/wave.glsl"

layout(constant_id = 28) const bool NUMBERED = false;  // each slot has a pixel and sample of its own: adaptive samples, or a wave that is kept full
#define CLERESTORY_NUMBERED NUMBERED

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
    float edge_bound;       // of EDGE_BOUND, beyond which paths have the light of an edge
} push;

// Whether a path that has been scattered goes on, by a number in [0, 1); weights it if it does.
bool path_roulette(inout WalkState path, float u) {
    if (path.bounce < push.roulette_start) {
        return true;
    }
    vec3 t = path.throughput * path.eta_scale;
    float survival = min(max(t.x, max(t.y, t.z)), push.roulette_cap);
    // Also ends a path whose throughput is not a number.
    if (!(u < survival)) {
        return false;
    }
    path.throughput /= survival;
    return true;
}

#endif
