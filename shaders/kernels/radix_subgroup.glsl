// Keys and values of the radix sort whose teams are workgroups: set 0 of its kernels. Loads are coalesced.
#ifndef CLERESTORY_KERNELS_RADIX_SUBGROUP_GLSL
#define CLERESTORY_KERNELS_RADIX_SUBGROUP_GLSL

#include "kernels/radix.glsl"

// descriptor set 0: RadixSubgroupSet

layout(set = 0, binding = 1, scalar) restrict readonly buffer RadixKeysFrom { uint radix_keys_from[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer RadixKeysTo { uint radix_keys_to[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer RadixValuesFrom { uint radix_values_from[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer RadixValuesTo { uint radix_values_to[]; };

// Low and high word.
uvec2 load_key(uint at) {
    return uvec2(radix_keys_from[KEY_WORDS * at], KEY_WORDS == 2u ? radix_keys_from[2u * at + 1u] : 0u);
}

#endif
