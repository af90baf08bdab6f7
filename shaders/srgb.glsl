// The transfer function of sRGB (IEC 61966-2-1) and its inverse, for values in [0, 1]; twin of clerestory::srgb.
#ifndef CLERESTORY_SRGB_GLSL
#define CLERESTORY_SRGB_GLSL

const float SRGB_SLOPE = 12.92;
const float SRGB_OFFSET = 0.055;
const float SRGB_EXPONENT = 2.4;
const float SRGB_LINEAR_END = 0.0031308;  // where the straight piece ends, linear
const float SRGB_ENCODED_END = 0.04045;   // and encoded

vec3 srgb_from_linear(vec3 c) {
    return mix((1.0 + SRGB_OFFSET) * pow(c, vec3(1.0 / SRGB_EXPONENT)) - SRGB_OFFSET, SRGB_SLOPE * c,
               lessThanEqual(c, vec3(SRGB_LINEAR_END)));
}

vec3 linear_from_srgb(vec3 c) {
    return mix(c * (1.0 / SRGB_SLOPE), pow((c + SRGB_OFFSET) * (1.0 / (1.0 + SRGB_OFFSET)), vec3(SRGB_EXPONENT)),
               greaterThan(c, vec3(SRGB_ENCODED_END)));
}

#endif
