#version 460
// Radix sort, first stage of a digit: each workgroup counts the digits of its block in shared memory.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_subgroup.glsl"

shared uint counts[BINS];

void main() {
    uint team = gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationID.x;
    uint count = stream_size(push.plan);
    uvec2 range = stream_range(team, count, stream_block(count, push.plan.tile, push.plan.max_teams));
    for (uint digit = lane; digit < BINS; digit += LANES) {
        counts[digit] = 0u;
    }
    barrier();
    for (uint at = range.x + lane; at < range.y; at += LANES) {
        uvec2 key = load_key(at);
        atomicAdd(counts[radix_digit(key.x, key.y)], 1u);
    }
    barrier();
    for (uint digit = lane; digit < BINS; digit += LANES) {
        scratch[count_at(digit, team)] = counts[digit];
    }
}
