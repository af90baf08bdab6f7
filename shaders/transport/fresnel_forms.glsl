// Cheaper forms of the conductor's Fresnel factor: Schlick's curve between the exact ends, less a term that makes the dip near grazing
// incidence, and the conductor without the sine in its root.
//
// Sources: Lazányi and Szirmay-Kalos, "Fresnel Term Approximations for Metals" (WSCG 2005) for the rescaled and the compensated curve;
// Hoffman, "Fresnel Equations Considered Harmful" (MAM 2019), and Kutz, Hašan and Edmondson, "Novel Aspects of the Adobe Standard Material"
// (2021) for the exponent 6; Gulbrandsen, "Artist Friendly Metallic Fresnel" (JCGT 3(4), 2014) for the simplified conductor and its index by two colours.
// Guarantees: results lie in [0, 1] for cosines in [0, 1] and alpha >= 1; coefficients come from the host (transport/fresnel/).
#ifndef CLERESTORY_TRANSPORT_FRESNEL_FORMS_GLSL
#define CLERESTORY_TRANSPORT_FRESNEL_FORMS_GLSL

#include "transport/fresnel.glsl"

// Greatest reflectance that two colours give: 1 would need an infinite index.
const float REFLECTANCE_MAX = 0.9999;

// Reflectance of a conductor against vacuum at normal incidence.
vec3 conductor_f0(vec3 eta, vec3 k) {
    vec3 below = eta - 1.0;
    vec3 above = eta + 1.0;
    vec3 k2 = k * k;
    return (below * below + k2) / (above * above + k2);
}

// Schlick's curve scaled to the conductor's reflectance at normal incidence, as one fraction; k = 0 gives Schlick's own.
vec3 fresnel_rescaled(float cos_i, vec3 eta, vec3 k) {
    vec3 below = eta - 1.0;
    vec3 above = eta + 1.0;
    vec3 k2 = k * k;
    return (below * below + k2 + 4.0 * schlick_weight(cos_i) * eta) / (above * above + k2);
}

// Schlick's curve less a cos (1 - cos)^alpha.
vec3 fresnel_compensated(float cos_i, vec3 f0, vec3 a, vec3 alpha) {
    float m = clamp(1.0 - cos_i, 0.0, 1.0);
    return clamp(fresnel_schlick(cos_i, f0) - a * cos_i * pow(vec3(m), alpha), vec3(0.0), vec3(1.0));
}

// The same with the exponent 6, by multiplication.
vec3 fresnel_tinted(float cos_i, vec3 f0, vec3 b) {
    float m = clamp(1.0 - cos_i, 0.0, 1.0);
    float weight = schlick_weight(cos_i);
    return clamp(f0 + (1.0 - f0) * weight - b * (cos_i * m * weight), vec3(0.0), vec3(1.0));
}

// The conductor with sin^2 left out beside |eta + i k|^2.
vec3 fresnel_simplified(float cos_i, vec3 eta, vec3 k) {
    float c2 = cos_i * cos_i;
    vec3 s = eta * eta + k * k;
    vec3 cross_term = 2.0 * cos_i * eta;
    vec3 sum_p = s * c2 + 1.0;
    vec3 sum_s = s + c2;
    return 0.5 * ((sum_p - cross_term) / (sum_p + cross_term) + (sum_s - cross_term) / (sum_s + cross_term));
}

// n and k of a reflectance at normal incidence and an edge tint.
void artistic_index(vec3 reflectance, vec3 edge_tint, out vec3 eta, out vec3 k) {
    vec3 r = clamp(reflectance, vec3(0.0), vec3(REFLECTANCE_MAX));
    vec3 g = clamp(edge_tint, vec3(0.0), vec3(1.0));
    vec3 above = 1.0 + sqrt(r);
    vec3 least = (1.0 - r) / (1.0 + r);
    vec3 greatest = above * above / (1.0 - r);
    eta = g * least + (1.0 - g) * greatest;
    k = sqrt(max((eta - 1.0 / greatest) * (g * (greatest - least)), vec3(0.0)));
}

// Cosine-weighted hemispherical averages: 2 int F mu dmu.
vec3 fresnel_schlick_average(vec3 f0) { return f0 + (1.0 - f0) * (1.0 / 21.0); }

vec3 fresnel_compensated_average(vec3 f0, vec3 a, vec3 alpha) {
    return fresnel_schlick_average(f0) - 4.0 * a / ((alpha + 1.0) * (alpha + 2.0) * (alpha + 3.0));
}

#endif
