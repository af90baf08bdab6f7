#version 460
// The fused form of three stages of a bounce in scenes with media: the closest hit of an eye path's ray (walk/extend.comp), the ray's way through the medium before it and the query of the
// volume map along that (photon_beam.comp), whose light is added at once. Each is the function that the stages have, so that all is the same to the bit.
//
// What does not end here is left to the stages: a ray that its quota stops, a walk through a grid or a query likewise, and places that are not begun since the submission's work is used up
// all stall the wave as rays of extend.comp do. `walk_resume` says how far a place is (PLACE_RAY_ENDED): its ray has ended, its walk goes on, its way is known (BEAM_ASKS), or all is done.
//
// PM-ST-1: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 7.4, which has kernels of their own for each and no such form. Deterministic as photon_beam.comp.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define BEAM_FINDS_HITS
#include "techniques/photon_mapping/photon_beam.glsl"

// Loop iterations of a ray from which on they count as work of the submission.
layout(constant_id = 27) const uint WORK_LEAST = WORK_UNIT;

#define INDEX_RESUMES false
#include "walk/closest_hit.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    bool begun = has_work_left();
    uint slot = load_slot(place);
    WalkState path = load_walk(slot);
    Hit hit = no_hit(FAR_AWAY);
    uint resume = find_closest_hit(slot, path, begun, INDEX_START, hit);
    walk_hits_out[place] = hit;
    walk_resume[place] = resume;
    count_work(index_iterations, WORK_LEAST);
    if (resume != INDEX_FINISHED) {
        stall_place(STALLED_EXTEND, begun);
        return;
    }
    if (!has_work_left()) {
        leave_for_later(STALLED_EXTEND);
        return;
    }
    bool walks;
    bool asks = begin_beam(slot, place, path, hit, false, walks);
    walk_resume[place] = walks ? BEAM_WALKING : BEAM_DONE;
    if (!asks) {
        count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
    }
    if (walks) {
        leave_for_later(STALLED_EXTEND);
    }
    if (asks && !ask_beam(slot, place, path)) {
        walk_resume[place] = BEAM_ASKS;
        leave_for_later(STALLED_EXTEND);
    }
}
