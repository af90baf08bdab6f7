// Digits of keys: what all forms of the radix sort share.
#ifndef CLERESTORY_KERNELS_RADIX_DIGIT_GLSL
#define CLERESTORY_KERNELS_RADIX_DIGIT_GLSL

// Invocations of a workgroup: the specialization constant 0.
#define LANES gl_WorkGroupSize.x
// Digits that there are, a power of two.
layout(constant_id = 1) const uint BINS = 16u;
// 32-bit words of a key, the low one first: 1 or 2.
layout(constant_id = 2) const uint KEY_WORDS = 1u;
layout(constant_id = 3) const bool HAS_VALUES = false;

// Keys that an invocation which walks a block reads together: texels or vectors of four words, one or two.
const uint KEYS_PER_READ = 4u;

// The digit whose lowest bit is `first`, as wide as `mask`; `flip` is the mask for descending order, and 0 else.
uint radix_digit_at(uint low, uint high, uint first, uint mask, uint flip) {
    uint shift = first & 31u;
    uint bits = (first < 32u ? low : high) >> shift;
    if (KEY_WORDS == 2u && first < 32u && shift != 0u) {
        bits |= high << (32u - shift);
    }
    return (bits & mask) ^ flip;
}

#endif
