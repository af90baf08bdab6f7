// Isotropic GGX microfacets with Smith masking.
//
// Sources: Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007); Heitz, "Understanding the
// Masking-Shadowing Function" (JCGT 3(2), 2014); visible normals by spherical caps, Dupuy and Benyoub, "Sampling Visible GGX
// Normals with Spherical Caps" (HPG 2023).
// Guarantees: for alpha >= ALPHA_MIN all values are finite in f32; sampled normals face wo and the macrosurface.
// Expects: `SEPARABLE_MASKING`, a bool constant: G1 G1 in place of the height-correlated form, for comparison with other renderers.
#ifndef CLERESTORY_TRANSPORT_GGX_GLSL
#define CLERESTORY_TRANSPORT_GGX_GLSL

#include "transport/warp.glsl"

// Below this the lobe is a Dirac delta: half vectors carry errors of 1e-7, a part in 10^4 of this width.
const float ALPHA_MIN = 1e-3;

// Density of microfacet normals.
float ggx_d(vec3 h, float alpha) {
    float a2 = alpha * alpha;
    float d = dot(h.xy, h.xy) + a2 * h.z * h.z;
    return a2 * INV_PI / (d * d);
}

// sqrt(1 + alpha^2 tan^2) cos: the part of Smith's Lambda that all masking terms share.
float ggx_stretched_cos(float cos_theta, float alpha) {
    float a2 = alpha * alpha;
    return sqrt(a2 + (1.0 - a2) * cos_theta * cos_theta);
}

float ggx_g1(float cos_theta, float alpha) { return 2.0 * cos_theta / (cos_theta + ggx_stretched_cos(cos_theta, alpha)); }

// Masking and shadowing of a reflection; both cosines positive.
float ggx_g2(float cos_o, float cos_i, float alpha) {
    if (SEPARABLE_MASKING) {
        return ggx_g1(cos_o, alpha) * ggx_g1(cos_i, alpha);
    }
    float o = cos_i * ggx_stretched_cos(cos_o, alpha);
    float i = cos_o * ggx_stretched_cos(cos_i, alpha);
    return 2.0 * cos_o * cos_i / (o + i);
}

// Density of the normals visible from wo, per solid angle of h.
float ggx_visible_pdf(vec3 wo, vec3 h, float alpha) {
    return 2.0 * max(dot(wo, h), 0.0) * ggx_d(h, alpha) / (wo.z + ggx_stretched_cos(wo.z, alpha));
}

vec3 ggx_sample_visible(vec3 wo, float alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * wo.xy, wo.z));
    float z = (1.0 - u.y) * (1.0 + v.z) - v.z;
    float r = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    float phi = 2.0 * PI * u.x;
    vec3 h = vec3(r * cos(phi), r * sin(phi), z) + v;
    return normalize(vec3(alpha * h.xy, h.z));
}

#endif
