// Numbers of summed-area tables: two words each, of a kind that a constant chooses. Sources and guarantees: maps/spherical_sat.rs.
#ifndef CLERESTORY_MAPS_SAT_VALUE_GLSL
#define CLERESTORY_MAPS_SAT_VALUE_GLSL

#include "film/two_float.glsl"

// What sums are: a float, the unevaluated sum of two floats, or an integer of 64 bits.
const uint SAT_FLOAT = 0u;
const uint SAT_TWO_FLOAT = 1u;
const uint SAT_FIXED = 2u;

layout(constant_id = 122) const uint SAT_NUMBERS = SAT_FIXED;

const uint SAT_CHANNELS = 4u;
// 2^32.
const float SAT_HIGH_WORD = 4294967296.0;

// Red, green and blue, weighted, and the weight.
struct SatValue {
    uvec2 channel[SAT_CHANNELS];
};

// Two's complement, low word first.
uvec2 sat_negated(uvec2 a) { return uvec2(~a.x + 1u, ~a.y + (a.x == 0u ? 1u : 0u)); }

uvec2 sat_added(uvec2 a, uvec2 b) {
    if (SAT_NUMBERS == SAT_FIXED) {
        uint carry;
        uint low = uaddCarry(a.x, b.x, carry);
        return uvec2(low, a.y + b.y + carry);
    }
    vec2 x = uintBitsToFloat(a);
    vec2 y = uintBitsToFloat(b);
    if (SAT_NUMBERS == SAT_FLOAT) {
        return uvec2(floatBitsToUint(x.x + y.x), 0u);
    }
    TwoFloat sum = two_float_add_two_float(TwoFloat(x.x, x.y), TwoFloat(y.x, y.y));
    return floatBitsToUint(vec2(sum.hi, sum.lo));
}

uvec2 sat_subtracted(uvec2 a, uvec2 b) {
    return sat_added(a, SAT_NUMBERS == SAT_FIXED ? sat_negated(b) : floatBitsToUint(-uintBitsToFloat(b)));
}

// A number; `scale`, a power of two, makes it an integer.
uvec2 sat_number(float value, float scale) {
    if (SAT_NUMBERS != SAT_FIXED) {
        return uvec2(floatBitsToUint(value), 0u);
    }
    // Both words are exact: the float has 24 bits.
    float whole = round(abs(value) * scale);
    float high = floor(whole / SAT_HIGH_WORD);
    uvec2 magnitude = uvec2(uint(whole - high * SAT_HIGH_WORD), uint(high));
    return value < 0.0 ? sat_negated(magnitude) : magnitude;
}

float sat_float(uvec2 a, float scale) {
    if (SAT_NUMBERS != SAT_FIXED) {
        vec2 x = uintBitsToFloat(a);
        return x.x + x.y;
    }
    bool negative = (a.y >> 31u) != 0u;
    uvec2 magnitude = negative ? sat_negated(a) : a;
    float value = (float(magnitude.y) * SAT_HIGH_WORD + float(magnitude.x)) / scale;
    return negative ? -value : value;
}

#endif
