// 64-bit counters of two words, low word first.
#ifndef CLERESTORY_WIDE_COUNTER_GLSL
#define CLERESTORY_WIDE_COUNTER_GLSL

// Adds to a counter: whoever carries the low word over adds the carry.
#define COUNT_WIDE(COUNTER, AMOUNT) { \
    uint counted_amount = AMOUNT; \
    if (counted_amount > 0u && atomicAdd(COUNTER[0], counted_amount) > 0xFFFFFFFFu - counted_amount) { \
        atomicAdd(COUNTER[1], 1u); \
    } \
}

#endif
