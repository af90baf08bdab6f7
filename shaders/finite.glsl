// Light that has overflowed.
#ifndef CLERESTORY_FINITE_GLSL
#define CLERESTORY_FINITE_GLSL

// The greatest finite number.
const float FINITE_MAX = 3.402823e38;

// `light` where it is finite, else black: what overflows is closer than numbers can tell.
vec3 finite_or_black(vec3 light) { return all(lessThanEqual(light, vec3(FINITE_MAX))) ? light : vec3(0.0); }

#endif
