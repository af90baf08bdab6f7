// Morton codes of 30 and 63 bits over exact bounds; twin of clerestory::accel::morton, to the bit on every device.
#ifndef CLERESTORY_ACCEL_MORTON_GLSL
#define CLERESTORY_ACCEL_MORTON_GLSL

const uint MORTON_30_AXIS_BITS = 10u;
const uint MORTON_63_AXIS_BITS = 21u;
// Biased exponent of the least extent that is divided into cells.
const uint MORTON_MIN_EXTENT_EXPONENT = 37u;

const uint FLOAT_FRACTION_BITS = 23u;
const uint FLOAT_EXPONENT_BIAS = 127u;
const uint FLOAT_HIDDEN_BIT = 1u << FLOAT_FRACTION_BITS;

// 2^axis_bits / extent, truncated to 24 bits: long division, since devices may divide with an error.
float cells_per_length(float extent, uint axis_bits) {
    uint bits = floatBitsToUint(extent);
    uint exponent = bits >> FLOAT_FRACTION_BITS;
    if (exponent < MORTON_MIN_EXTENT_EXPONENT || exponent >= FLOAT_EXPONENT_BIAS + 32u) {
        return 0.0;
    }
    uint divisor = (bits & (FLOAT_HIDDEN_BIT - 1u)) | FLOAT_HIDDEN_BIT;
    uint remainder = FLOAT_HIDDEN_BIT;
    uint quotient = 0u;
    // The quotient of a power of two is a power of two itself, one exponent up.
    uint carry = divisor == FLOAT_HIDDEN_BIT ? 1u : 0u;
    for (uint i = 0u; i <= FLOAT_FRACTION_BITS; ++i) {
        remainder <<= 1;
        quotient <<= 1;
        if (remainder >= divisor) {
            remainder -= divisor;
            quotient |= 1u;
        }
    }
    uint fraction = carry != 0u ? 0u : quotient & (FLOAT_HIDDEN_BIT - 1u);
    return uintBitsToFloat((axis_bits + 2u * FLOAT_EXPONENT_BIAS - 1u + carry - exponent) << FLOAT_FRACTION_BITS | fraction);
}

// Cell of a point in a grid of 2^axis_bits an axis; a coordinate that is NaN lies in the last.
uvec3 morton_cell(vec3 point, vec3 lower, vec3 scale, uint axis_bits) {
    uint last = (1u << axis_bits) - 1u;
    precise vec3 place = (point - lower) * scale;
    bvec3 inside = lessThan(place, vec3(float(last)));
    return uvec3(inside.x ? uint(place.x) : last, inside.y ? uint(place.y) : last, inside.z ? uint(place.z) : last);
}

// Puts two zeros before each of ten bits.
uint spread_10(uint x) {
    x = (x | x << 16) & 0x030000FFu;
    x = (x | x << 8) & 0x0300F00Fu;
    x = (x | x << 4) & 0x030C30C3u;
    return (x | x << 2) & 0x09249249u;
}

// Interleaves three numbers of 10 bits, z first.
uint morton_30(uvec3 cell) {
    return spread_10(cell.z) << 2 | spread_10(cell.y) << 1 | spread_10(cell.x);
}

// Interleaves three numbers of 21 bits, z first; low word, high word.
uvec2 morton_63(uvec3 cell) {
    uint low = morton_30(cell & 0x3FFu);
    uvec3 high = cell >> 10;
    uint middle = morton_30(high & 0x3FFu);
    uvec3 last = high >> 10;
    uint top = last.z << 2 | last.y << 1 | last.x;
    return uvec2(low | middle << 30, middle >> 2 | top << 28);
}

#endif
