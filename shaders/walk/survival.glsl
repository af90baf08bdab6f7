// How walks from lights end.
#ifndef CLERESTORY_WALK_SURVIVAL_GLSL
#define CLERESTORY_WALK_SURVIVAL_GLSL

#include "accel/ray.glsl"

// From this bounce on no walk is sure to go on.
const uint CAPPED_BOUNCE = 8u;
const float SURVIVAL_MAX = 0.95;

// Probability with which a walk goes on that a scattering leaves so much of its power; between lossless surfaces walks end by SURVIVAL_MAX alone. Not a number
// where the power is none.
float walk_survival(vec3 before, vec3 after, uint bounce) {
    float most = bounce < CAPPED_BOUNCE ? 1.0 : SURVIVAL_MAX;
    return min(largest_component(after) / largest_component(before), most);
}

#endif
