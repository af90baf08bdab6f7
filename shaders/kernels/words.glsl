// Operations of reductions over 32-bit words, on 64-bit values as low and high word.
#ifndef CLERESTORY_KERNELS_WORDS_GLSL
#define CLERESTORY_KERNELS_WORDS_GLSL

#include "kernels/operation.glsl"

uvec2 words_identity(uint operation) { return uvec2(operation == OPERATION_MIN ? LARGEST_WORD : 0u, 0u); }

uvec2 words_combine(uint operation, uvec2 a, uvec2 b) {
    if (operation == OPERATION_MIN) {
        return uvec2(min(a.x, b.x), 0u);
    }
    if (operation == OPERATION_MAX) {
        return uvec2(max(a.x, b.x), 0u);
    }
    uint carry;
    uint low = uaddCarry(a.x, b.x, carry);
    return uvec2(low, a.y + b.y + carry);
}

#endif
