// The closest hit of a walk's ray: what extend.comp finds at every place of a wave, and stages that find hits themselves. Expects what walk/candidate_rays.glsl does, and HAS_MEDIA.
#ifndef CLERESTORY_WALK_CLOSEST_HIT_GLSL
#define CLERESTORY_WALK_CLOSEST_HIT_GLSL

#include "walk/candidate_rays.glsl"
#include "walk/media.glsl"

// Searches from `resume` on, improving `hit`; where the search goes on, or INDEX_FINISHED. A ray that is left for later, not `begun`, stays where it was.
uint find_closest_hit(uint slot, WalkState walk, bool begun, uint resume, inout Hit hit) {
    begin_candidates(slot, walk.bounce, CANDIDATES_EXTEND);
    float t_min = 0.0;
    if (HAS_MEDIA) {
        // Behind the boundaries that the walk has passed.
        t_min = status.rounds > 0u ? search_start(walk_medium_states[slot].start) : 0.0;
    }
    // One that is left for later has no direction, which ends its traversal at once.
    vec3 direction = begun ? walk.direction : vec3(0.0);
    uint next = closest_hit(Ray(walk.origin, t_min, direction, FAR_AWAY), INDEX_RESUMES ? resume : INDEX_START, hit);
    return begun ? next : resume;
}

#endif
