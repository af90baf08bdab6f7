// The shadow stage of the wavefront path tracer: adds what light sampling found wherever nothing stands in between.
//
// Stopped rays stall the wave as in path_extend.glsl.
#ifndef CLERESTORY_TRANSPORT_PATH_SHADOW_GLSL
#define CLERESTORY_TRANSPORT_PATH_SHADOW_GLSL

#include "transport/path_candidates.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || place >= status.active_count || (flags[place] & FLAG_SHADOW) == 0u) {
        return;
    }
    uint resume = resume_words[2u * place + 1u];
    if (resume == BVH2_FINISHED) {
        return;
    }
    ShadowRay s = shadow[place];
    Hit hit = no_hit(s.ray.t_max);
    BEGIN_CANDIDATES(queue_in[place], CANDIDATES_SHADOW)
    resume = any_hit(s.ray, resume, hit);
    resume_words[2u * place + 1u] = resume;
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_SHADOW);
    } else if (hit.triangle == NO_HIT) {
        paths[queue_in[place]].radiance += s.contribution;
    }
}

#endif
