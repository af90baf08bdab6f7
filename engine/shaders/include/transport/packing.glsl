// Directions and colours in a word.
//
// Sources: octahedral map of Meyer et al., "On Floating-Point Normal Vectors" (2010), as surveyed by Cigolle et al. (JCGT 3(2), 2014);
// colours in the format E5B9G9R9_UFLOAT_PACK32 of the Vulkan specification. Guarantees: directions are off by at most 5.2e-4 (13 bits), 1.3e-4 (15 bits) or
// 6.5e-5 (16 bits) radians, those along axes by nothing; bands by 2^-9 of the largest one, down to 2^-25 absolute and up to 65408.
#ifndef CLERESTORY_TRANSPORT_PACKING_GLSL
#define CLERESTORY_TRANSPORT_PACKING_GLSL

const float RGB9E5_MAX = 65408.0;
const int RGB9E5_BIAS = 15;
const int RGB9E5_MANTISSA_BITS = 9;
const int PACKING_FLOAT_BIAS = 127;
const int PACKING_FLOAT_MANTISSA_BITS = 23;

vec2 octahedral_signs(vec2 v) { return vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0); }

// A unit vector with so many bits (13, 15 or 16) for each of the two coordinates, the first ones lowest.
uint pack_octahedral(vec3 n, uint bits) {
    vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    p = n.z < 0.0 ? (1.0 - abs(p.yx)) * octahedral_signs(p) : p;
    float steps = float((1u << (bits - 1u)) - 1u);
    uvec2 q = uvec2(floor(p * steps + 0.5) + steps);
    return q.x | q.y << bits;
}

vec3 unpack_octahedral(uint word, uint bits) {
    float steps = float((1u << (bits - 1u)) - 1u);
    uint mask = (1u << bits) - 1u;
    vec2 p = vec2(uvec2(word, word >> bits) & mask) / steps - 1.0;
    float z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3(p - octahedral_signs(p) * max(-z, 0.0), z));
}

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
