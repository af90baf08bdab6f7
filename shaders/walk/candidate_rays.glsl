// The rays of walks among candidate hits that count by their materials' alpha: the key that these are drawn by, and the index with them as its filter. Expects the constants
// HAS_ALPHA and those of transport/attribute_features.glsl, `push` and CLERESTORY_NUMBERED as walk/draws.glsl does, and INDEX_RESUMES (accel/index_rays.glsl).
#ifndef CLERESTORY_WALK_CANDIDATE_RAYS_GLSL
#define CLERESTORY_WALK_CANDIDATE_RAYS_GLSL

#include "walk/draws.glsl"
#include "walk/candidate_alpha.glsl"

const uint CANDIDATES_EXTEND = 0u;
const uint CANDIDATES_SHADOW = 1u;

// The key of a ray's candidates: (sequence, index, bounce and kind, seed).
void begin_candidates(uint slot, uint bounce, uint kind) {
    if (HAS_ALPHA) {
        count_quarters(CLERESTORY_NUMBERED ? 1u : 0u);
        candidate_key = uvec4(walk_sequence(slot), walk_index(slot), bounce * 2u + kind, push.key.seed);
    }
}

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

#endif
