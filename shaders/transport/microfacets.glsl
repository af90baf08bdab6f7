// Classical parts of the microfacet product: Beckmann's distribution, the cosine lobe, and the geometric terms of Cook and Torrance, of Kelemen and
// Szirmay-Kalos, and of Smith.
//
// Sources and guarantees: transport/microfacets.rs. All directions in the frame whose z is the normal; cosines of l and v with it are positive. Geometric
// terms hold the 1/(4 (n.l) (n.v)) of the product.
#ifndef CLERESTORY_TRANSPORT_MICROFACETS_GLSL
#define CLERESTORY_TRANSPORT_MICROFACETS_GLSL

#include "transport/below_one.glsl"
#include "transport/warp.glsl"

// Below this cosine of microfacet incidence the simplified term is cut off.
const float SIMPLIFIED_COSINE_MIN = 1e-3;
// From this 1 / (m tan) on Beckmann's G1 is taken as 1 (Walter et al. 2007, equation 27).
const float BECKMANN_UNMASKED_MIN = 1.6;
// sqrt(pi) - 1: Smith's Lambda of GGX over that of Beckmann's distribution at grazing incidence, less 1.
const float GGX_EXCESS = 0.77245385;

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

// Beckmann's masking of a direction w, of slope m.
float beckmann_g1(vec3 w, float m) {
    float c = w.z;
    float slope = m * length(w.xy);
    return c >= BECKMANN_UNMASKED_MIN * slope
        ? 1.0
        : c * (3.535 * slope + 2.181 * c) / (slope * slope + 2.276 * slope * c + 2.577 * c * c);
}

// The cosine lobe's masking of a direction w, of exponent s.
float cosine_lobe_g1(vec3 w, float s) {
    float width2 = 2.0 / (s + 2.0);
    float beckmann = beckmann_g1(w, sqrt(width2));
    float ggx = 2.0 * w.z / (w.z + sqrt(w.z * w.z + width2 * dot(w.xy, w.xy)));
    float last = GGX_EXCESS - 0.75 - 1.0 / 64.0;
    float share = width2 * (0.75 + width2 * (1.0 / 64.0 + width2 * last)) / ((2.0 - width2) * GGX_EXCESS);
    return beckmann * ggx / (ggx + share * (beckmann - ggx));
}

// Smith's term of both directions' masking.
float smith_g(vec3 l, vec3 v, float g1_l, float g1_v) { return g1_l * g1_v / (4.0 * l.z * v.z); }

#endif
