// What is kept of a ray through media that walk/medium_ray.glsl follows.
#ifndef CLERESTORY_WALK_MEDIUM_RAY_STATE_GLSL
#define CLERESTORY_WALK_MEDIUM_RAY_STATE_GLSL

#include "accel/ray.glsl"

struct MediumRay {
    vec3 transmittance;  // so far
    uint cursor;         // where the search of its next surface goes on
    Hit hit;
    float start;         // as in ShadowState
    uint interior;       // body that the stretch is in, or OUTSIDE
    uint grid_walks;     // so far
};

// A way before anything of it is known.
struct ShadowWay {
    Ray ray;
    uint interior;  // body that it begins in, or OUTSIDE
    float start;    // in lengths of the ray's direction: 0, or negative by what the offset of its origin left out
};

#endif
