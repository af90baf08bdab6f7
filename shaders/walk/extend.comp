#version 460
// The extend stage of a wave: the closest hit of every walk's ray.
//
// A ray that its quota stops is counted and stalls the wave: the later stages leave at once, and the host runs this stage again, which
// goes on where the ray was. So do rays that are left for later, since the submission's work is used up; they have not begun.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/candidates.glsl"
#include "walk/closest_hit.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    uint resume = push.goes_on != GOES_ON_NOT ? walk_resume[place] : INDEX_START;
    if (resume == INDEX_FINISHED || (push.goes_on == GOES_ON_FURTHER && resume >= PLACE_RAY_ENDED)) {
        return;
    }
    bool begun = has_work_left();
    uint slot = load_slot(place);
    // What it carries is not read here.
    count_quarters(WALK_STATE_QUARTERS - 1u);
    WalkState walk = load_walk(slot);
    Hit hit = no_hit(FAR_AWAY);
    if (RESUMES && resume != INDEX_START) {
        hit = walk_hits_out[place];
    }
    resume = find_closest_hit(slot, walk, begun, resume, hit);
    walk_hits_out[place] = hit;
    walk_resume[place] = resume;
    count_work(index_iterations, WORK_LEAST);
    add_fetches(FETCHES_EXTEND);
    if (resume != INDEX_FINISHED) {
        stall_place(STALLED_EXTEND, begun);
    }
}
