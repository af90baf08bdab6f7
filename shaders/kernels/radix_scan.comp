#version 460
// Radix sort, second stage of a digit: for each digit, the prefix sums of the teams' counts, and their total. A digit is a workgroup's
// work or an invocation's.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix.glsl"
#include "kernels/wrapping_sum.glsl"

layout(constant_id = 4) const bool SERIAL = true;

void main() {
    uint digit = SERIAL ? gl_GlobalInvocationID.x : gl_WorkGroupID.x;
    if (digit >= BINS) {
        return;
    }
    uint count = stream_size(push.plan);
    uint teams = stream_teams(count, stream_block(count, push.plan.tile, push.plan.max_teams));
    uint first = 0u;
    uint last = teams;
    uint before = 0u;
    if (!SERIAL) {
        uint each = (teams + LANES - 1u) / LANES;
        first = min(gl_LocalInvocationID.x * each, teams);
        last = min(first + each, teams);
        uint own = 0u;
        for (uint team = first; team < last; ++team) {
            own += scratch[count_at(digit, team)];
        }
        uint total;
        before = team_exclusive(own, total);
    }
    for (uint team = first; team < last; ++team) {
        uint own = scratch[count_at(digit, team)];
        scratch[count_at(digit, team)] = before;
        before += own;
    }
    if (SERIAL || gl_LocalInvocationID.x == LANES - 1u) {
        scratch[total_at(digit)] = before;
    }
}
