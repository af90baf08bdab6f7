// Phase functions: how a medium scatters about the direction of propagation.
//
// |g| and |k| are below 1; c is the cosine between the directions of propagation before and after (forward scattering: g, k > 0). Sources: Henyey and
// Greenstein (1941); Rayleigh (1871); Blasi, Le Saec and Schlick, "A Rendering Algorithm for Discrete Volume Density Objects" (1993).
// Guarantees: densities per solid angle that integrate to one and are sampled exactly, so that weights are one.
#ifndef CLERESTORY_TRANSPORT_PHASE_GLSL
#define CLERESTORY_TRANSPORT_PHASE_GLSL

#include "scene/records.glsl"
#include "transport/warp.glsl"

// Henyey and Greenstein's density of a = |g|, where the cosine is x = 1 - c below that of the peak.
float henyey_greenstein_below_peak(float x, float a) {
    // 1 + g^2 - 2 g c without its cancellation.
    float d = (1.0 - a) * (1.0 - a) + 2.0 * a * x;
    return UNIFORM_SPHERE_PDF * (1.0 - a) * (1.0 + a) / (d * sqrt(d));
}

float henyey_greenstein(float c, float g) { return henyey_greenstein_below_peak(max(1.0 - (g < 0.0 ? -c : c), 0.0), abs(g)); }

float henyey_greenstein_sample(float g, float u) {
    // The inversion as a distance from the peak, which neither cancels there nor divides by g.
    float a = abs(g);
    float s = 1.0 - a + 2.0 * a * u;
    float x = (1.0 - a) * (1.0 - u) * ((1.0 - a) * (1.0 + a) / s + 1.0 - a) / s;
    float c = clamp(1.0 - x, -1.0, 1.0);
    return g < 0.0 ? -c : c;
}

float schlick_below_peak(float x, float a) {
    float d = 1.0 - a + a * x;
    return UNIFORM_SPHERE_PDF * (1.0 - a) * (1.0 + a) / (d * d);
}

float schlick_phase(float c, float k) { return schlick_below_peak(max(1.0 - (k < 0.0 ? -c : c), 0.0), abs(k)); }

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

// The phase function of a medium, from propagation direction w to wi: `kind` is one of PHASE_..., `parameter` g or k.
float phase_function(uint kind, float parameter, vec3 w, vec3 wi) {
    // Half the square of the chord to the peak is 1 - c without its cancellation.
    vec3 chord = parameter < 0.0 ? wi + w : wi - w;
    float x = 0.5 * dot(chord, chord);
    float a = abs(parameter);
    return kind == PHASE_HENYEY_GREENSTEIN ? henyey_greenstein_below_peak(x, a)
        : kind == PHASE_SCHLICK ? schlick_below_peak(x, a)
        : kind == PHASE_RAYLEIGH ? rayleigh_phase(1.0 - x) : UNIFORM_SPHERE_PDF;
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
