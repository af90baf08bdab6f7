#version 460
// Radix sort, third stage of a digit: each invocation walks its block in order and writes every key to the next place of its digit.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_serial.glsl"

uint places[BINS];

void place(uint low, uint high, uint value) {
    uint digit = radix_digit(low, high);
    uint target = places[digit];
    places[digit] = target + 1u;
    radix_keys_out[KEY_WORDS * target] = low;
    if (KEY_WORDS == 2u) {
        radix_keys_out[2u * target + 1u] = high;
    }
    if (HAS_VALUES) {
        radix_values_out[target] = value;
    }
}

uvec4 load_values(uint first) {
    return HAS_VALUES ? texelFetch(radix_values_in, int(first / 4u)) : uvec4(0u);
}

void main() {
    uint team = gl_GlobalInvocationID.x;
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    if (team >= stream_teams(count, block)) {
        return;
    }
    uint before = 0u;
    for (uint digit = 0u; digit < BINS; ++digit) {
        places[digit] = before + scratch[count_at(digit, team)];
        before += scratch[total_at(digit)];
    }
    uvec2 range = stream_range(team, count, block);
    uvec4 low, high;
    uint first = range.x;
    for (; first + KEYS_A_READ <= range.y; first += KEYS_A_READ) {
        load_keys(first, range.y, low, high);
        uvec4 values = load_values(first);
        place(low.x, high.x, values.x);
        place(low.y, high.y, values.y);
        place(low.z, high.z, values.z);
        place(low.w, high.w, values.w);
    }
    if (first < range.y) {
        load_keys(first, range.y, low, high);
        uvec4 values = load_values(first);
        for (uint i = 0u; first + i < range.y; ++i) {
            place(low[i], high[i], values[i]);
        }
    }
}
