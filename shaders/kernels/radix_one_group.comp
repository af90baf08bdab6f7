#version 460
// Radix sort of few keys by one workgroup, in one dispatch: the three stages of every digit, with keys and values that go from one side of the
// buffers to the other. For software devices, where shared memory is memory like any other, and where dispatches and the barriers between
// them are a large part of what few keys take.
//
// Each invocation walks a block of its own with counters of its own, so equal digits keep their order. After Satish, Harris and Garland,
// Designing efficient sorting algorithms for manycore GPUs (2009), section 4, with invocations for blocks. A word counts two digits, which
// halves the work of the scan.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_few.glsl"
#include "kernels/wrapping_sum.glsl"

// By four words, which software drivers load together. Other invocations read what one has written.
layout(set = 0, binding = 2, scalar) restrict coherent buffer RadixKeysA { uvec4 radix_keys_a[]; };
layout(set = 0, binding = 3, scalar) restrict coherent buffer RadixKeysB { uvec4 radix_keys_b[]; };
layout(set = 0, binding = 4, scalar) restrict coherent buffer RadixValuesA { uvec4 radix_values_a[]; };
layout(set = 0, binding = 5, scalar) restrict coherent buffer RadixValuesB { uvec4 radix_values_b[]; };

// Digits d and d + PAIRS share a word.
const uint PAIRS = BINS / 2u;

// By pair of digits: how many there are in the block; then the place of the next.
uint own_places[PAIRS];
// By pair, then invocation: the same.
shared uint places[PAIRS * LANES];

// Four words of a side's keys from `first` on, a multiple of four; behind `last` zeros, since there may be nothing to read.
uvec4 key_words(uint side, uint first, uint last) {
    uint at = first / 4u;
    if (first + 4u <= last) {
        return side == 0u ? radix_keys_a[at] : radix_keys_b[at];
    }
    uvec4 words = uvec4(0u);
    for (uint i = 0u; i < 4u && first + i < last; ++i) {
        words[i] = side == 0u ? radix_keys_a[at][i] : radix_keys_b[at][i];
    }
    return words;
}

// The same of values.
uvec4 value_words(uint side, uint first, uint last) {
    uint at = first / 4u;
    if (first + 4u <= last) {
        return side == 0u ? radix_values_a[at] : radix_values_b[at];
    }
    uvec4 words = uvec4(0u);
    for (uint i = 0u; i < 4u && first + i < last; ++i) {
        words[i] = side == 0u ? radix_values_a[at][i] : radix_values_b[at][i];
    }
    return words;
}

// Low and high words of the keys `first` to `first` + 3 of a side, as far as they lie before `last`.
void load_keys(uint side, uint first, uint last, out uvec4 low, out uvec4 high) {
    if (KEY_WORDS == 1u) {
        low = key_words(side, first, last);
        high = uvec4(0u);
    } else {
        uvec4 a = key_words(side, 2u * first, 2u * last);
        uvec4 b = key_words(side, 2u * first + 4u, 2u * last);
        low = uvec4(a.xz, b.xz);
        high = uvec4(a.yw, b.yw);
    }
}

void store_key_word(uint side, uint word, uint value) {
    if (side == 0u) {
        radix_keys_a[word / 4u][word % 4u] = value;
    } else {
        radix_keys_b[word / 4u][word % 4u] = value;
    }
}

void store_value(uint side, uint place, uint value) {
    if (side == 0u) {
        radix_values_a[place / 4u][place % 4u] = value;
    } else {
        radix_values_b[place / 4u][place % 4u] = value;
    }
}

uint pair_of(uint digit) { return digit % PAIRS; }
uint shift_of(uint digit) { return digit < PAIRS ? 0u : PAIR_BITS; }

// Counts become the places of the first of each digit in the block.
void scan_places() {
    uint lane = gl_LocalInvocationID.x;
    for (uint pair = 0u; pair < PAIRS; ++pair) {
        places[pair * LANES + lane] = own_places[pair];
    }
    barrier();
    uint first = lane * PAIRS;
    uint own = 0u;
    for (uint i = first; i < first + PAIRS; ++i) {
        own += places[i];
    }
    uint total;
    uint before = team_exclusive(own, total);
    // The second digits of all pairs come after the first ones.
    before += total << PAIR_BITS;
    for (uint i = first; i < first + PAIRS; ++i) {
        uint count = places[i];
        places[i] = before;
        before += count;
    }
    barrier();
    for (uint pair = 0u; pair < PAIRS; ++pair) {
        own_places[pair] = places[pair * LANES + lane];
    }
}

void count_digit(uint digit, bool live) { own_places[pair_of(digit)] += uint(live) << shift_of(digit); }

void put(uint side, uint digit, uint low, uint high, uint value) {
    uint pair = pair_of(digit);
    uint both = own_places[pair];
    own_places[pair] = both + (1u << shift_of(digit));
    uint place = bitfieldExtract(both, int(shift_of(digit)), int(PAIR_BITS));
    store_key_word(side, KEY_WORDS * place, low);
    if (KEY_WORDS == 2u) {
        store_key_word(side, 2u * place + 1u, high);
    }
    if (HAS_VALUES) {
        store_value(side, place, value);
    }
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint count = keys_to_sort();
    uint block = (count + KEYS_PER_READ * LANES - 1u) / (KEYS_PER_READ * LANES) * KEYS_PER_READ;
    uint first = min(lane * block, count);
    uint last = min(first + block, count);
    uint from = 0u;
    for (uint bit = push.first_bit; bit < push.last_bit; bit += digit_bits()) {
        uint mask = mask_of_digit(bit);
        uint flip = push.descending * mask;
        for (uint pair = 0u; pair < PAIRS; ++pair) {
            own_places[pair] = 0u;
        }
        uvec4 low, high;
        for (uint at = first; at < last; at += KEYS_PER_READ) {
            load_keys(from, at, last, low, high);
            count_digit(radix_digit_at(low.x, high.x, bit, mask, flip), true);
            count_digit(radix_digit_at(low.y, high.y, bit, mask, flip), at + 1u < last);
            count_digit(radix_digit_at(low.z, high.z, bit, mask, flip), at + 2u < last);
            count_digit(radix_digit_at(low.w, high.w, bit, mask, flip), at + 3u < last);
        }
        scan_places();
        uint to = 1u - from;
        for (uint at = first; at < last; at += KEYS_PER_READ) {
            load_keys(from, at, last, low, high);
            uvec4 values = uvec4(0u);
            if (HAS_VALUES) {
                values = value_words(from, at, last);
            }
            put(to, radix_digit_at(low.x, high.x, bit, mask, flip), low.x, high.x, values.x);
            if (at + 1u < last) {
                put(to, radix_digit_at(low.y, high.y, bit, mask, flip), low.y, high.y, values.y);
            }
            if (at + 2u < last) {
                put(to, radix_digit_at(low.z, high.z, bit, mask, flip), low.z, high.z, values.z);
            }
            if (at + 3u < last) {
                put(to, radix_digit_at(low.w, high.w, bit, mask, flip), low.w, high.w, values.w);
            }
        }
        from = to;
        memoryBarrierBuffer();
        barrier();
    }
}
