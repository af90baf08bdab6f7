// Phase functions: how a medium scatters about the direction of propagation.
//
// |g| and |k| are below 1; c is the cosine between the directions of propagation before and after (forward scattering: g, k > 0). Sources: Henyey and
// Greenstein (1941); Rayleigh (1871); Blasi, Le Saec and Schlick, "A Rendering Algorithm for Discrete Volume Density Objects" (1993).
// Guarantees: densities per solid angle that integrate to one and are sampled exactly, so that weights are one.
#ifndef CLERESTORY_TRANSPORT_PHASE_GLSL
#define CLERESTORY_TRANSPORT_PHASE_GLSL

#include "scene/records.glsl"
#include "transport/warp.glsl"

// Below this |g| the inversion loses its digits and the lobe is taken as isotropic.
const float HENYEY_GREENSTEIN_MIN = 1e-3;

float henyey_greenstein(float c, float g) {
    // 1 + g^2 - 2 g c without its cancellation at the peak.
    float a = abs(g);
    float d = (1.0 - a) * (1.0 - a) + 2.0 * (a - g * c);
    return UNIFORM_SPHERE_PDF * (1.0 - g * g) / (d * sqrt(d));
}

float henyey_greenstein_sample(float g, float u) {
    if (abs(g) < HENYEY_GREENSTEIN_MIN) {
        return 1.0 - 2.0 * u;
    }
    float s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    return clamp((1.0 + g * g - s * s) / (2.0 * g), -1.0, 1.0);
}

float schlick_phase(float c, float k) {
    float d = 1.0 - k * c;
    return UNIFORM_SPHERE_PDF * (1.0 - k * k) / (d * d);
}

float schlick_phase_sample(float k, float u) {
    float x = 2.0 * u - 1.0;
    return clamp((x + k) / (1.0 + k * x), -1.0, 1.0);
}

// Scattering by particles far smaller than the wavelength.
float rayleigh_phase(float c) { return 0.75 * UNIFORM_SPHERE_PDF * (1.0 + c * c); }

float rayleigh_phase_sample(float u) {
    // The real root of c^3 + 3 c = 2 q.
    float q = 4.0 * u - 2.0;
    float z = pow(abs(q) + sqrt(q * q + 1.0), 1.0 / 3.0);
    return clamp(q < 0.0 ? 1.0 / z - z : z - 1.0 / z, -1.0, 1.0);
}

// The phase function of a medium: `kind` is one of PHASE_..., `parameter` g or k.
float phase_function(uint kind, float parameter, float c) {
    return kind == PHASE_HENYEY_GREENSTEIN ? henyey_greenstein(c, parameter)
        : kind == PHASE_SCHLICK ? schlick_phase(c, parameter)
        : kind == PHASE_RAYLEIGH ? rayleigh_phase(c) : UNIFORM_SPHERE_PDF;
}

float phase_function_sample(uint kind, float parameter, float u) {
    return kind == PHASE_HENYEY_GREENSTEIN ? henyey_greenstein_sample(parameter, u)
        : kind == PHASE_SCHLICK ? schlick_phase_sample(parameter, u)
        : kind == PHASE_RAYLEIGH ? rayleigh_phase_sample(u) : 1.0 - 2.0 * u;
}

// The direction after scattering of propagation direction w, at cosine c and azimuth 2 pi u.
vec3 phase_direction(vec3 w, float c, float u) {
    vec3 local = direction_below_pole(1.0 - c, u);
    vec3 t;
    vec3 b;
    orthonormal_basis(w, t, b);
    return t * local.x + b * local.y + w * local.z;
}

#endif
