#version 460
// The ways of eye paths through media, and which of them ask the volume map: the stage before queries that have a queue. A place that asks is marked so (BEAM_ASKS) until its
// query takes it; one whose way is not known yet, since a quota stops its walk through a grid or the submission's work is used up, stalls the wave and goes on when the stage is
// recorded again. Guarantees: what it leaves of a way is what a query without a queue finds.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_beam_way.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (!wave_has_arrived() || place >= status.active_count) {
        return;
    }
    uint resume = walk_resume[place];
    if (beam_was_begun(resume)) {
        return;
    }
    if (!has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    uint slot = load_slot(place);
    bool walks;
    bool asks = begin_beam(slot, place, load_walk(slot), load_hit(place), resume == BEAM_WALKING, walks);
    walk_resume[place] = walks ? BEAM_WALKING : asks ? BEAM_ASKS : BEAM_DONE;
    count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
    if (walks) {
        leave_for_later(STALLED_ARRIVAL);
    }
}
