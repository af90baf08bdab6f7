// Keys and values of the radix sort whose teams are single invocations: set 0 of its kernels.
//
// Keys are read by texels of four words, since software drivers fetch those for all lanes at once but load storage buffers lane by lane.
#ifndef CLERESTORY_KERNELS_RADIX_SERIAL_GLSL
#define CLERESTORY_KERNELS_RADIX_SERIAL_GLSL

#include "kernels/radix.glsl"

// descriptor set 0: RadixSerialSet

layout(set = 0, binding = 1) uniform utextureBuffer radix_keys_in;
layout(set = 0, binding = 2, scalar) restrict buffer RadixKeysOut { uint radix_keys_out[]; };
layout(set = 0, binding = 3) uniform utextureBuffer radix_values_in;
layout(set = 0, binding = 4, scalar) restrict buffer RadixValuesOut { uint radix_values_out[]; };

// Low and high words of the keys `first` to `first` + 3, as far as they lie before `last`.
void load_keys(uint first, uint last, out uvec4 low, out uvec4 high) {
    if (KEY_WORDS == 1u) {
        low = texelFetch(radix_keys_in, int(first / 4u));
        high = uvec4(0u);
    } else {
        uvec4 a = texelFetch(radix_keys_in, int(first / 2u));
        uvec4 b = first + 2u < last ? texelFetch(radix_keys_in, int(first / 2u + 1u)) : uvec4(0u);
        low = uvec4(a.xz, b.xz);
        high = uvec4(a.yw, b.yw);
    }
}

#endif
