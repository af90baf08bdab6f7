#version 460
// Radix sort, first stage of a digit: each invocation counts the digits of its block in private memory.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_serial.glsl"

void main() {
    uint team = gl_GlobalInvocationID.x;
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    if (team >= stream_teams(count, block)) {
        return;
    }
    uint counts[BINS];
    for (uint digit = 0u; digit < BINS; ++digit) {
        counts[digit] = 0u;
    }
    uvec2 range = stream_range(team, count, block);
    uvec4 low, high;
    uint first = range.x;
    for (; first + KEYS_PER_READ <= range.y; first += KEYS_PER_READ) {
        load_keys(first, range.y, low, high);
        counts[radix_digit(low.x, high.x)] += 1u;
        counts[radix_digit(low.y, high.y)] += 1u;
        counts[radix_digit(low.z, high.z)] += 1u;
        counts[radix_digit(low.w, high.w)] += 1u;
    }
    if (first < range.y) {
        load_keys(first, range.y, low, high);
        for (uint i = 0u; first + i < range.y; ++i) {
            counts[radix_digit(low[i], high[i])] += 1u;
        }
    }
    for (uint digit = 0u; digit < BINS; ++digit) {
        scratch[count_at(digit, team)] = counts[digit];
    }
}
