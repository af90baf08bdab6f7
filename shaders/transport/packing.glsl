// Colours in a word; directions in a word are those of maps/packed_direction.glsl.
//
// Source: the format E5B9G9R9_UFLOAT_PACK32 of the Vulkan specification. Guarantees: bands are off by at most 2^-9 of the largest one,
// down to 2^-25 absolute and up to 65408.
#ifndef CLERESTORY_TRANSPORT_PACKING_GLSL
#define CLERESTORY_TRANSPORT_PACKING_GLSL

const float RGB9E5_MAX = 65408.0;
const int RGB9E5_BIAS = 15;
const int RGB9E5_MANTISSA_BITS = 9;
const int PACKING_FLOAT_BIAS = 127;
const int PACKING_FLOAT_MANTISSA_BITS = 23;

float packing_power(int exponent) { return intBitsToFloat((exponent + PACKING_FLOAT_BIAS) << PACKING_FLOAT_MANTISSA_BITS); }

// Bands are clamped to [0, RGB9E5_MAX].
uint pack_rgb9e5(vec3 color) {
    color = clamp(color, 0.0, RGB9E5_MAX);
    float largest = max(color.x, max(color.y, color.z));
    int exponent = max((floatBitsToInt(largest) >> PACKING_FLOAT_MANTISSA_BITS) - PACKING_FLOAT_BIAS, -RGB9E5_BIAS - 1) + 1;
    exponent += int(floor(largest * packing_power(RGB9E5_MANTISSA_BITS - exponent) + 0.5)) >> RGB9E5_MANTISSA_BITS;
    uvec3 q = uvec3(floor(color * packing_power(RGB9E5_MANTISSA_BITS - exponent) + 0.5));
    return q.x | q.y << 9 | q.z << 18 | uint(exponent + RGB9E5_BIAS) << 27;
}

vec3 unpack_rgb9e5(uint word) {
    return vec3(uvec3(word, word >> 9, word >> 18) & 0x1FFu) * packing_power(int(word >> 27) - RGB9E5_BIAS - RGB9E5_MANTISSA_BITS);
}

#endif
