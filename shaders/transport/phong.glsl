// Modified Phong reflection with conserved energy.
//
// f = reflectance (n + 2) / (2 pi) cos^n, measured from the mirror direction: Lafortune and Willems (1994). Guarantees: reciprocal;
// albedo = reflectance at normal incidence, less at other angles, where the horizon cuts the lobe. The lobe ends a right angle from
// the mirror direction, so that n = 0 is Lambert at normal incidence only. Frame: z is the normal; wo.z > 0.
#ifndef CLERESTORY_TRANSPORT_PHONG_GLSL
#define CLERESTORY_TRANSPORT_PHONG_GLSL

#include "transport/warp.glsl"

// f cos.
vec3 phong_eval(vec3 reflectance, float exponent, vec3 wo, vec3 wi) {
    float c = dot(vec3(-wo.xy, wo.z), wi);
    if (wi.z <= 0.0 || c <= 0.0) {
        return vec3(0.0);
    }
    return reflectance * ((exponent + 2.0) * (0.5 * INV_PI) * pow(c, exponent) * wi.z);
}

// Density of phong_sample over the whole sphere.
float phong_pdf(float exponent, vec3 wo, vec3 wi) {
    float c = dot(vec3(-wo.xy, wo.z), wi);
    return c > 0.0 ? (exponent + 1.0) * (0.5 * INV_PI) * pow(c, exponent) : 0.0;
}

// A direction about the mirror direction; it may lie below the surface, where phong_eval is zero.
vec3 phong_sample(float exponent, vec3 wo, vec2 u) {
    float c = pow(1.0 - u.y, 1.0 / (exponent + 1.0));
    vec3 w = direction_below_pole(1.0 - c, u.x);
    vec3 mirror = vec3(-wo.xy, wo.z);
    vec3 t;
    vec3 b;
    orthonormal_basis(mirror, t, b);
    return t * w.x + b * w.y + mirror * w.z;
}

#endif
