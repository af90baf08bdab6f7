// The shadow stage of the wavefront path tracer: adds what light sampling found wherever nothing stands in between.
//
// Stopped rays stall the wave as in path_extend.glsl.
#ifndef CLERESTORY_TRANSPORT_PATH_SHADOW_GLSL
#define CLERESTORY_TRANSPORT_PATH_SHADOW_GLSL

#include "transport/path_candidates.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || place >= status.shadow_count) {
        return;
    }
    ShadowRay s = load_shadow_ray(texelFetch(path_shadow_queue_in, int(place)).x);
    BEGIN_CANDIDATES(s.slot, s.bounce, CANDIDATES_SHADOW)
    Hit hit = no_hit(s.t_max);
    uint resume = INDEX_START;
    if (RESUMES) {
        resume = path_resume[place];
    }
    bool ended = resume == INDEX_FINISHED;
    resume = any_hit(Ray(s.origin, 0.0, s.direction, s.t_max), resume, hit);
    path_resume[place] = resume;
    if (resume != INDEX_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_SHADOW);
    } else if (!ended && hit.triangle == NO_HIT) {
        path_gathered[s.slot].radiance += s.contribution;
    }
}

#endif
