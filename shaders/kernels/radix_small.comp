#version 460
// Radix sort of few keys by one workgroup, in one dispatch: the three stages of every digit in shared memory.
//
// Each invocation walks a block of its own, so equal digits keep their order. What moves from digit to digit is the key itself, or its
// place in the input where keys are wide or have values. After Satish, Harris and Garland, Designing efficient sorting algorithms for
// manycore GPUs (2009), section 4, with invocations for blocks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_few.glsl"
#include "kernels/wrapping_sum.glsl"

layout(constant_id = 4) const uint CAPACITY = 1024u;

layout(set = 0, binding = 2, scalar) restrict readonly buffer RadixKeysFrom { uint radix_keys_from[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer RadixKeysTo { uint radix_keys_to[]; };
layout(set = 0, binding = 4, scalar) restrict readonly buffer RadixValuesFrom { uint radix_values_from[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer RadixValuesTo { uint radix_values_to[]; };

const bool KEYS_MOVE = KEY_WORDS == 1u && !HAS_VALUES;

// Two sides, each digit goes from one to the other.
shared uint moving[2u * CAPACITY];
// By digit, then invocation: how many there are; after the scan, the place of the next.
shared uint places[BINS * LANES];

uvec2 key_of(uint element) {
    if (KEYS_MOVE) {
        return uvec2(element, 0u);
    }
    return uvec2(radix_keys_from[KEY_WORDS * element], KEY_WORDS == 2u ? radix_keys_from[2u * element + 1u] : 0u);
}

// Counts become the places of the first of each digit and invocation.
void scan_places() {
    uint first = gl_LocalInvocationID.x * BINS;
    uint own = 0u;
    for (uint i = first; i < first + BINS; ++i) {
        own += places[i];
    }
    uint total;
    uint before = team_exclusive(own, total);
    for (uint i = first; i < first + BINS; ++i) {
        uint count = places[i];
        places[i] = before;
        before += count;
    }
}

void put(uint place, uint element, uvec2 key) {
    radix_keys_to[KEY_WORDS * place] = key.x;
    if (KEY_WORDS == 2u) {
        radix_keys_to[2u * place + 1u] = key.y;
    }
    if (HAS_VALUES) {
        radix_values_to[place] = radix_values_from[element];
    }
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint count = keys_to_sort();
    uint block = (count + LANES - 1u) / LANES;
    uint first = min(lane * block, count);
    uint last = min(first + block, count);
    for (uint at = first; at < last; ++at) {
        moving[at] = KEYS_MOVE ? radix_keys_from[at] : at;
    }
    uint from = 0u;
    for (uint bit = push.first_bit; bit < push.last_bit; bit += digit_bits()) {
        uint mask = mask_of_digit(bit);
        uint flip = push.descending * mask;
        for (uint digit = 0u; digit < BINS; ++digit) {
            places[digit * LANES + lane] = 0u;
        }
        for (uint at = first; at < last; ++at) {
            uvec2 key = key_of(moving[from + at]);
            places[radix_digit_at(key.x, key.y, bit, mask, flip) * LANES + lane] += 1u;
        }
        barrier();
        scan_places();
        barrier();
        bool is_last = bit + digit_bits() >= push.last_bit;
        uint to = CAPACITY - from;
        for (uint at = first; at < last; ++at) {
            uint element = moving[from + at];
            uvec2 key = key_of(element);
            uint slot = radix_digit_at(key.x, key.y, bit, mask, flip) * LANES + lane;
            uint place = places[slot];
            places[slot] = place + 1u;
            if (is_last) {
                put(place, element, key);
            } else {
                moving[to + place] = element;
            }
        }
        from = to;
        barrier();
    }
}
