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
    uint slot = imageLoad(path_queue_in, int(place)).x;
    PathState path = load_path(slot);
    BEGIN_CANDIDATES(slot, path.bounce, CANDIDATES_EXTEND)
    Hit hit = no_hit(FAR_AWAY);
    uint resume = BVH2_START;
    if (status.resuming == STALLED_EXTEND) {
        hit = load_hit(place);
        resume = imageLoad(path_resume, int(place)).x;
    }
    resume = closest_hit(Ray(path.origin, 0.0, path.direction, FAR_AWAY), resume, hit);
    store_hit(place, hit);
    imageStore(path_resume, int(place), uvec4(resume));
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_EXTEND);
    }
}

#endif
