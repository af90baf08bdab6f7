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
    ShadowRay s = load_shadow_ray(imageLoad(path_shadow_queue, int(place)).x);
    BEGIN_CANDIDATES(s.slot, s.bounce, CANDIDATES_SHADOW)
    Hit hit = no_hit(s.ray.t_max);
    uint resume = BVH2_START;
    if (status.resuming == STALLED_SHADOW) {
        resume = imageLoad(path_resume, int(place)).x;
    }
    bool ended = resume == BVH2_FINISHED;
    resume = any_hit(s.ray, resume, hit);
    imageStore(path_resume, int(place), uvec4(resume));
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_SHADOW);
    } else if (!ended && hit.triangle == NO_HIT) {
        PathGathered gathered = load_gathered(s.slot);
        gathered.radiance += s.contribution;
        store_gathered(s.slot, gathered);
    }
}

#endif
