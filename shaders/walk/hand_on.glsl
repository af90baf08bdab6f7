// How a stage that scatters walks hands on what it has made, in scenes with media and in others: shadow rays that wait at a place, and walks that
// go on. What is returned belongs into the place's walk_flags_out.
#ifndef CLERESTORY_WALK_HAND_ON_GLSL
#define CLERESTORY_WALK_HAND_ON_GLSL

#include "transport/features.glsl"
#include "walk/wave.glsl"

// Lets a shadow ray wait at a place. It begins inside the body of material `interior`, or OUTSIDE; the way through what is there begins at `start`,
// in lengths of the ray's direction: 0, or negative by what the offset of its origin left out.
uint store_shadow_ray(uint place, ShadowRay ray, uint interior, float start) {
    store_waiting(place, uvec4(floatBitsToUint(ray.origin), floatBitsToUint(ray.t_max)), uvec4(floatBitsToUint(ray.direction), ray.slot),
                  uvec4(floatBitsToUint(ray.contribution), ray.bounce));
    if (HAS_MEDIA) {
        walk_shadow_starts[place].sampled_interior = interior;
        walk_shadow_starts[place].start = start;
        return FLAG_WAITING | FLAG_SAMPLED;
    }
    return FLAG_WAITING;
}

// Lets a walk go on that a surface has scattered; `start` is that of its way, 0, or negative as above, in metres.
uint store_walk(uint slot, WalkState walk, float start) {
    if (HAS_MEDIA) {
        walk_medium_states[slot].start = start;
    }
    walk_states_out[slot] = walk;
    return FLAG_ALIVE;
}

#endif
