#version 460
// The extend stage of a wave: the closest hit of every walk's ray.
//
// A ray that its quota stops is counted and stalls the wave: the later stages leave at once, and the host runs this stage again, which
// goes on where the ray was.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/candidates.glsl"
#include "walk/media.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    WalkState walk = load_walk(slot);
    begin_candidates(slot, walk.bounce, CANDIDATES_EXTEND);
    Hit hit = no_hit(FAR_AWAY);
    uint resume = INDEX_START;
    if (RESUMES) {
        hit = walk_hits_out[place];
        resume = walk_resume[place];
    }
    float t_min = 0.0;
    if (HAS_MEDIA) {
        // Behind the boundaries that the walk has passed.
        t_min = status.rounds > 0u ? search_start(walk_medium_states[slot].start) : 0.0;
    }
    resume = closest_hit(Ray(walk.origin, t_min, walk.direction, FAR_AWAY), resume, hit);
    walk_hits_out[place] = hit;
    walk_resume[place] = resume;
    if (resume != INDEX_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_EXTEND);
    }
}
