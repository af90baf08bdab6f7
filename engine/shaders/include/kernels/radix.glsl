// What the stages of the radix sort share: digits, and where their counts are in the scratch memory.
//
// Least-significant-digit radix sort in three stages a digit: counts by team, prefix sums over the teams of each digit, scatter. After
// Satish, Harris and Garland, Designing efficient sorting algorithms for manycore GPUs (2009), section 4.
#ifndef CLERESTORY_KERNELS_RADIX_GLSL
#define CLERESTORY_KERNELS_RADIX_GLSL

#include "kernels/stream_scratch.glsl"

// Invocations of a workgroup: the specialization constant 0.
#define LANES gl_WorkGroupSize.x
// Digits that there are, a power of two.
layout(constant_id = 1) const uint BINS = 16u;
// 32-bit words of a key, the low one first: 1 or 2.
layout(constant_id = 2) const uint KEY_WORDS = 1u;
layout(constant_id = 3) const bool HAS_VALUES = false;

layout(push_constant, scalar) uniform Push {
    StreamPlan plan;
    uint shift;  // of the digit's lowest bit
    uint mask;   // of a digit, at bit 0
    uint flip;   // exclusive-or of digits: the mask for descending order
} push;

// The number of equal digits in the whole stream, by digit.
uint total_at(uint digit) { return digit; }
// The number of equal digits in a team's block; after the scan, in the blocks before it.
uint count_at(uint digit, uint team) { return BINS + digit * push.plan.max_teams + team; }

uint radix_digit(uint low, uint high) {
    uint shift = push.shift & 31u;
    uint bits = (push.shift < 32u ? low : high) >> shift;
    if (KEY_WORDS == 2u && push.shift < 32u && shift != 0u) {
        bits |= high << (32u - shift);
    }
    return (bits & push.mask) ^ push.flip;
}

#endif
