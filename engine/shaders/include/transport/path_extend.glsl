// The extend stage of the wavefront path tracer: the closest hit of every path's ray.
//
// A ray that its quota stops is counted and stalls the wave: the later stages leave at once, and the host runs this stage again, which
// goes on where the ray was.
#ifndef CLERESTORY_TRANSPORT_PATH_EXTEND_GLSL
#define CLERESTORY_TRANSPORT_PATH_EXTEND_GLSL

#include "transport/path_candidates.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    uint resume = resume_words[2u * place];
    if (resume == BVH2_FINISHED) {
        return;
    }
    Ray ray = rays[queue_in[place]];
    Hit hit = no_hit(ray.t_max);
    BEGIN_CANDIDATES(queue_in[place], CANDIDATES_EXTEND)
    if (resume != BVH2_START) {
        hit = hits[place];
    }
    resume = closest_hit(ray, resume, hit);
    hits[place] = hit;
    resume_words[2u * place] = resume;
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_EXTEND);
    }
}

#endif
