// What the radix sorts of one workgroup are told: their push constants, and the number of keys that is in a buffer.
#ifndef CLERESTORY_KERNELS_RADIX_FEW_GLSL
#define CLERESTORY_KERNELS_RADIX_FEW_GLSL

#include "kernels/radix_digit.glsl"
#include "kernels/stream_scratch.glsl"

// Bits of a counter where a word has two: there are fewer than 2^16 keys.
const uint PAIR_BITS = 16u;

layout(set = 0, binding = 1, scalar) restrict readonly buffer StreamCounts { uint stream_counts[]; };

layout(push_constant, scalar) uniform Push {
    uint count;       // keys, or STREAM_COUNT_ON_DEVICE
    uint capacity;    // keys at most
    uint first_bit;   // compared, and the one past the last
    uint last_bit;
    uint descending;  // 1 or 0
} push;

uint keys_to_sort() {
    if (push.count != STREAM_COUNT_ON_DEVICE) {
        return push.count;
    }
    uint wanted = stream_counts[0];
    uint count = wanted <= push.capacity ? wanted : 0u;
    if (gl_LocalInvocationID.x == 0u) {
        stream_count = count;
        stream_wanted = wanted;
    }
    return count;
}

// Bits of all digits but the last, which may have fewer.
uint digit_bits() { return uint(findMSB(BINS)); }

uint mask_of_digit(uint bit) { return (1u << min(digit_bits(), push.last_bit - bit)) - 1u; }

#endif
