// The extend stage of the wavefront path tracer: the closest hit of every path's ray.
//
// A ray that its quota stops is counted and stalls the wave: the later stages leave at once, and the host runs this stage again, which
// goes on where the ray was.
#ifndef CLERESTORY_TRANSPORT_PATH_EXTEND_GLSL
#define CLERESTORY_TRANSPORT_PATH_EXTEND_GLSL

#include "transport/path_candidates.glsl"

#ifdef PATH_MEDIA
#include "transport/path_media.glsl"
#endif

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    PathState path = load_path(slot);
    BEGIN_CANDIDATES(slot, path.bounce, CANDIDATES_EXTEND)
    Hit hit = no_hit(FAR_AWAY);
    uint resume = INDEX_START;
    if (RESUMES) {
        hit = path_hits_out[place];
        resume = path_resume[place];
    }
    float t_min = 0.0;
#ifdef PATH_MEDIA
    // Behind the boundaries that the path has passed.
    t_min = status.rounds > 0u ? search_start(path_medium_states[slot].start) : 0.0;
#endif
    resume = closest_hit(Ray(path.origin, t_min, path.direction, FAR_AWAY), resume, hit);
    path_hits_out[place] = hit;
    path_resume[place] = resume;
    if (resume != INDEX_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_EXTEND);
    }
}

#endif
