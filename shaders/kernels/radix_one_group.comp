#version 460
// Radix sort of few keys by one workgroup, in one dispatch: the three stages of every digit, with keys and values that go from one side of the
// buffers to the other. For software devices, where shared memory is memory like any other, and where dispatches and the barriers between
// them take longer than the keys do.
//
// Each invocation walks a block of its own with counters of its own, so equal digits keep their order. After Satish, Harris and Garland,
// Designing efficient sorting algorithms for manycore GPUs (2009), section 4, with invocations for blocks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_few.glsl"
#include "kernels/radix_places.glsl"

// By four words, which software drivers load together. Other invocations read what one has written.
layout(set = 0, binding = 2, scalar) restrict coherent buffer RadixKeysA { uvec4 radix_keys_a[]; };
layout(set = 0, binding = 3, scalar) restrict coherent buffer RadixKeysB { uvec4 radix_keys_b[]; };
layout(set = 0, binding = 4, scalar) restrict coherent buffer RadixValuesA { uvec4 radix_values_a[]; };
layout(set = 0, binding = 5, scalar) restrict coherent buffer RadixValuesB { uvec4 radix_values_b[]; };

// How many there are of each digit in the block; then the place of the next.
uint next_places[BINS];

uvec4 key_words(uint side, uint at) { return side == 0u ? radix_keys_a[at] : radix_keys_b[at]; }

// Low and high words of the keys `first` to `first` + 3 of a side, as far as there are some.
void load_keys(uint side, uint first, uint last, out uvec4 low, out uvec4 high) {
    if (KEY_WORDS == 1u) {
        low = key_words(side, first / 4u);
        high = uvec4(0u);
    } else {
        uvec4 a = key_words(side, first / 2u);
        uvec4 b = first + 2u < last ? key_words(side, first / 2u + 1u) : uvec4(0u);
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

void place(uint side, uint digit, uint low, uint high, uint value) {
    uint target = next_places[digit];
    next_places[digit] = target + 1u;
    store_key_word(side, KEY_WORDS * target, low);
    if (KEY_WORDS == 2u) {
        store_key_word(side, 2u * target + 1u, high);
    }
    if (HAS_VALUES) {
        store_value(side, target, value);
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
        for (uint digit = 0u; digit < BINS; ++digit) {
            next_places[digit] = 0u;
        }
        uvec4 low, high;
        for (uint at = first; at < last; at += KEYS_PER_READ) {
            load_keys(from, at, last, low, high);
            for (uint i = 0u; i < KEYS_PER_READ; ++i) {
                next_places[radix_digit_at(low[i], high[i], bit, mask, flip)] += uint(at + i < last);
            }
        }
        for (uint digit = 0u; digit < BINS; ++digit) {
            places[place_slot(digit)] = next_places[digit];
        }
        barrier();
        scan_places();
        barrier();
        for (uint digit = 0u; digit < BINS; ++digit) {
            next_places[digit] = places[place_slot(digit)];
        }
        uint to = 1u - from;
        for (uint at = first; at < last; at += KEYS_PER_READ) {
            load_keys(from, at, last, low, high);
            uvec4 values = uvec4(0u);
            if (HAS_VALUES) {
                values = from == 0u ? radix_values_a[at / 4u] : radix_values_b[at / 4u];
            }
            for (uint i = 0u; i < KEYS_PER_READ; ++i) {
                if (at + i < last) {
                    place(to, radix_digit_at(low[i], high[i], bit, mask, flip), low[i], high[i], values[i]);
                }
            }
        }
        from = to;
        memoryBarrierBuffer();
        barrier();
    }
}
