// Classical parts of the microfacet product: Beckmann's distribution, the cosine lobe, and the geometric terms of Cook and Torrance and of Kelemen and
// Szirmay-Kalos.
//
// Sources and guarantees: transport/microfacets.rs. All directions in the frame whose z is the normal; cosines of l and v with it are positive. Geometric
// terms hold the 1/(4 (n.l) (n.v)) of the product.
#ifndef CLERESTORY_TRANSPORT_MICROFACETS_GLSL
#define CLERESTORY_TRANSPORT_MICROFACETS_GLSL

#include "transport/below_one.glsl"
#include "transport/warp.glsl"

// Below this cosine of microfacet incidence the simplified term is cut off.
const float SIMPLIFIED_COSINE_MIN = 1e-3;

// Beckmann's density of microfacet normals, of slope m.
float beckmann_d(vec3 h, float m) {
    float c2 = h.z * h.z;
    float m2 = m * m;
    return h.z > 0.0 ? exp(-dot(h.xy, h.xy) / (c2 * m2)) * INV_PI / (m2 * c2 * c2) : 0.0;
}

// The cosine lobe's density, of exponent s.
// cos^s comes from the sine, so that narrow lobes keep their digits.
float cosine_lobe_d(vec3 h, float s) {
    float sin2 = dot(h.xy, h.xy);
    return h.z > 0.0 && sin2 < 1.0 ? (s + 2.0) * (0.5 * INV_PI) * exp(0.5 * s * log_below_one(sin2)) : 0.0;
}

// The exponent of the lobe that is about as wide as Beckmann's and GGX's of a width: 0 for 1 (Walter et al. 2007, 5.2).
float cosine_lobe_exponent(float alpha) { return 2.0 / (alpha * alpha) - 2.0; }

vec3 normal_at(float cos_theta, float sin_theta, float u) {
    float phi = 2.0 * PI * u;
    return vec3(sin_theta * cos(phi), sin_theta * sin(phi), cos_theta);
}

// Normals by their density times their cosine.
vec3 beckmann_sample(float m, vec2 u) {
    float tan2 = -m * m * log_below_one(u.y);
    float cos_theta = inversesqrt(1.0 + tan2);
    return normal_at(cos_theta, cos_theta * sqrt(tan2), u.x);
}

vec3 cosine_lobe_sample(float s, vec2 u) {
    float sin2 = exp_below_one(-2.0 * log_below_one(u.y) / (s + 2.0));
    return normal_at(sqrt(1.0 - sin2), sqrt(sin2), u.x);
}

float cook_torrance_g(vec3 l, vec3 v, vec3 h) {
    float g = min(1.0, 2.0 * h.z * min(l.z, v.z) / dot(v, h));
    return g / (4.0 * l.z * v.z);
}

float kelemen_g(vec3 l, vec3 h) {
    float c = max(dot(l, h), SIMPLIFIED_COSINE_MIN);
    return 1.0 / (4.0 * c * c);
}

#endif
