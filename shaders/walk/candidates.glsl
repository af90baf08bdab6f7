// Which candidate hits count for a ray: all, or, specialized so, those where the material's alpha says that there is a surface. What the trace
// stages have in common stands here: their constants, and the push constants of all their kinds.
//
// A blended surface is met with a probability, drawn from a hash of (seed, sequence, index, bounce, kind of ray, triangle).
#ifndef CLERESTORY_WALK_CANDIDATES_GLSL
#define CLERESTORY_WALK_CANDIDATES_GLSL

#define CLERESTORY_SAMPLER SAMPLER_PCG
#include "walk/count_fetches.glsl"
#include "walk/wave.glsl"

// What a scene has, by the ids of transport/features.glsl.
layout(constant_id = 17) const bool HAS_ALPHA = true;
layout(constant_id = 19) const bool HAS_MEDIA = true;
// Goes on with rays that the quota stopped in an earlier dispatch; without it, only with rays that were left for later before they began.
layout(constant_id = 18) const bool RESUMES = false;
// Loop iterations of a ray from which on they count as work of the submission.
layout(constant_id = 27) const uint WORK_LEAST = WORK_UNIT;
// Walks have numbers of their own.
layout(constant_id = 28) const bool NUMBERED = false;
#define CLERESTORY_NUMBERED NUMBERED

// Where an earlier dispatch has handled a part of the places, as walk_resume says: rays of some have ended, or some are further on than that (PLACE_RAY_ENDED).
const uint GOES_ON_NOT = 0u;  // no place has begun
const uint GOES_ON_RAYS = 1u;
const uint GOES_ON_FURTHER = 2u;

layout(push_constant, scalar) uniform Push {
    WalkKey key;
    uint surrounding;  // index of the medium outside all bodies, or NO_MEDIUM
    uint goes_on;      // GOES_ON_*
} push;

#include "transport/attribute_features.glsl"
#include "walk/draws.glsl"
#define INDEX_RESUMES RESUMES
#include "walk/candidate_rays.glsl"

#endif
