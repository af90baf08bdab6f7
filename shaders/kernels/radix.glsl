// What the stages of the radix sort share: digits, and where their counts are in the scratch memory.
//
// Least-significant-digit radix sort in three stages a digit: counts by team, prefix sums over the teams of each digit, scatter. After
// Satish, Harris and Garland, Designing efficient sorting algorithms for manycore GPUs (2009), section 4.
#ifndef CLERESTORY_KERNELS_RADIX_GLSL
#define CLERESTORY_KERNELS_RADIX_GLSL

#include "kernels/radix_digit.glsl"
#include "kernels/stream_scratch.glsl"

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

uint radix_digit(uint low, uint high) { return radix_digit_at(low, high, push.shift, push.mask, push.flip); }

#endif
