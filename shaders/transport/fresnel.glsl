// Fresnel reflectance of unpolarized light at an interface.
//
// Sources: dielectric and conductor forms from Fresnel's equations (Born and Wolf, Principles of Optics, 1.5 and 14.2);
// Schlick, "An Inexpensive BRDF Model for Physically-based Rendering" (1994).
// Guarantees: results lie in [0, 1]; total internal reflection gives exactly 1; equal indices give exactly 0 off grazing.
#ifndef CLERESTORY_TRANSPORT_FRESNEL_GLSL
#define CLERESTORY_TRANSPORT_FRESNEL_GLSL

// Reflectance at normal incidence for a relative index of refraction.
float fresnel_f0(float eta) {
    float r = (eta - 1.0) / (eta + 1.0);
    return r * r;
}

// Exact dielectric; cos_i >= 0 on the incident side, eta = index beyond / index on the incident side.
float fresnel_dielectric(float cos_i, float eta) {
    float e = eta * eta - 1.0;
    float g2 = e + cos_i * cos_i;
    if (g2 <= 0.0) {
        return 1.0;
    }
    float g = sqrt(g2);
    float sum = g + cos_i;
    float a = e / (sum * sum);
    float b = (cos_i * sum - 1.0) / (cos_i * (g - cos_i) + 1.0);
    return min(1.0, 0.5 * a * a * (1.0 + b * b));
}

// What keeps the cases of 0/0 defined: no interface (eta = 1, k = 0) at a cosine of 0, which reflects nothing, and an index too small for its square at a
// cosine of 1.
const float LEAST_SUM = 1e-30;

// Exact conductor against vacuum, per band; complex index eta + i k.
vec3 fresnel_conductor(float cos_i, vec3 eta, vec3 k) {
    float c2 = cos_i * cos_i;
    float s2 = 1.0 - c2;
    vec3 d = eta * eta - k * k - s2;
    vec3 ek = eta * k;
    vec3 a2b2 = sqrt(d * d + 4.0 * ek * ek);
    // (a2b2 + d) / 2 without its cancellation at good metals, where d is negative: (a2b2 + d) (a2b2 - d) = 4 ek^2.
    vec3 a = sqrt(mix(2.0 * ek * ek / (a2b2 - d), 0.5 * (a2b2 + d), greaterThanEqual(d, vec3(0.0))));
    vec3 sum = a2b2 + c2;
    vec3 cross_s = 2.0 * cos_i * a;
    vec3 rs = (sum - cross_s) / (sum + cross_s + LEAST_SUM);
    vec3 sum_p = c2 * a2b2 + s2 * s2;
    vec3 cross_p = cross_s * s2;
    vec3 rp = rs * (sum_p - cross_p) / (sum_p + cross_p + LEAST_SUM);
    return clamp(0.5 * (rs + rp), vec3(0.0), vec3(1.0));
}

// (1 - cos)^5
float schlick_weight(float cos_i) {
    float m = clamp(1.0 - cos_i, 0.0, 1.0);
    float m2 = m * m;
    return m2 * m2 * m;
}

// Schlick's approximation with unit reflectance at grazing incidence.
vec3 fresnel_schlick(float cos_i, vec3 f0) { return f0 + (1.0 - f0) * schlick_weight(cos_i); }

#endif
