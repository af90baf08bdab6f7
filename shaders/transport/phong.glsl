// Modified Phong reflection with conserved energy.
//
// f = reflectance (n + 2) / (2 pi) cos^n, measured from the mirror direction: Lafortune and Willems (1994). Guarantees: reciprocal;
// albedo = reflectance at normal incidence, less at other angles, where the horizon cuts the lobe. The lobe ends a right angle from
// the mirror direction, so that n = 0 is Lambert at normal incidence only. cos^n comes from the distance to the mirror direction, so that
// narrow lobes keep their digits. Frame: z is the normal; wo.z > 0.
#ifndef CLERESTORY_TRANSPORT_PHONG_GLSL
#define CLERESTORY_TRANSPORT_PHONG_GLSL

#include "transport/below_one.glsl"
#include "transport/warp.glsl"

// The exponent whose lobe is about as wide as the GGX lobe of width alpha in (0, 1] (Walter et al. 2007, 5.2); 0 for 1.
float phong_exponent(float alpha) { return 0.5 * (1.0 / (alpha * alpha) - 1.0); }

// cos^n of the angle from the mirror direction; 0 from a right angle on.
float phong_power(float exponent, vec3 wo, vec3 wi) {
    vec3 from_mirror = wi - vec3(-wo.xy, wo.z);
    float below_one = 0.5 * dot(from_mirror, from_mirror);
    return below_one < 1.0 ? exp(exponent * log_below_one(below_one)) : 0.0;
}

// f cos.
vec3 phong_eval(vec3 reflectance, float exponent, vec3 wo, vec3 wi) {
    if (wi.z <= 0.0) {
        return vec3(0.0);
    }
    return reflectance * ((exponent + 2.0) * (0.5 * INV_PI) * phong_power(exponent, wo, wi) * wi.z);
}

// Density of phong_sample over the whole sphere.
float phong_pdf(float exponent, vec3 wo, vec3 wi) {
    return (exponent + 1.0) * (0.5 * INV_PI) * phong_power(exponent, wo, wi);
}

// A direction about the mirror direction; it may lie below the surface, where phong_eval is zero.
vec3 phong_sample(float exponent, vec3 wo, vec2 u) {
    vec3 w = direction_below_pole(exp_below_one(-log_below_one(u.y) / (exponent + 1.0)), u.x);
    vec3 mirror = vec3(-wo.xy, wo.z);
    vec3 t;
    vec3 b;
    orthonormal_basis(mirror, t, b);
    return t * w.x + b * w.y + mirror * w.z;
}

#endif
