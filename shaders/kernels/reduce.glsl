// What the stages of reductions share: a team's part, then all parts.
#ifndef CLERESTORY_KERNELS_REDUCE_GLSL
#define CLERESTORY_KERNELS_REDUCE_GLSL

#include "kernels/stream_scratch.glsl"

// Invocations of a workgroup: the specialization constant 0.
#define LANES gl_WorkGroupSize.x
layout(constant_id = 1) const uint OPERATION = 0u;
// A team is one invocation.
layout(constant_id = 2) const bool SERIAL = false;
// The second stage: one workgroup over the parts.
layout(constant_id = 3) const bool LAST = false;

uint reduce_team() { return LAST ? 0u : SERIAL ? gl_GlobalInvocationID.x : gl_WorkGroupID.x; }
uint reduce_lane() { return SERIAL && !LAST ? 0u : gl_LocalInvocationID.x; }
uint reduce_lanes() { return SERIAL && !LAST ? 1u : LANES; }

// The elements of a team, or the parts, that a lane takes: first, last, step. Lanes of a workgroup take neighbours.
uvec3 reduce_range(StreamPlan plan) {
    uint count = stream_size(plan);
    uint block = stream_block(count, plan.tile, plan.max_teams);
    uvec2 range = LAST ? uvec2(0u, stream_teams(count, block)) : stream_range(reduce_team(), count, block);
    return uvec3(range.x + reduce_lane(), range.y, reduce_lanes());
}

#endif
