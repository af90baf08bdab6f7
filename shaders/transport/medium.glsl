// Free flight, emission and direct light along a ray in a medium.
//
// Bands of the spectrum share one random walk: `bands` holds, of each band, the probability that it was the one whose coefficients the walk
// was sampled by, given the path so far. Each decision is drawn from the mixture and weighted by it, which is the one-sample balance heuristic over
// whole paths (Wilkie et al., "Hero Wavelength Spectral Sampling", 2014; with null collisions Miller, Georgiev and Jarosz, "A
// Null-scattering Path Integral Formulation of Light Transport", 2019): throughputs never exceed the number of bands times those of the
// band's own walk. Equi-angular sampling: Kulla and Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media" (2012).
// Distances are in metres from the start of the segment.
#ifndef CLERESTORY_TRANSPORT_MEDIUM_GLSL
#define CLERESTORY_TRANSPORT_MEDIUM_GLSL

#include "accel/ray.glsl"

// Optical depths beyond this leave nothing in f32.
const float EXPONENT_MAX = 80.0;
// Below this optical depth the attenuated length is taken from its series.
const float SERIES_DEPTH = 0.05;
// Transmittances below this are decided by roulette, with this chance to go on.
const float RATIO_ROULETTE_BELOW = 0.1;
const float RATIO_ROULETTE_SURVIVAL = 0.5;
// Density of equi-angular samples over that of collisions from which on they are taken: below, both together vary as much as collisions alone.
const float EQUI_ANGULAR_GAIN = 0.5;

// The band that u in [0, 1) chooses; never one of probability zero.
uint choose_band(vec3 bands, float u) {
    float target = u * (bands.x + bands.y + bands.z);
    uint chosen = target < bands.x ? 0u : target < bands.x + bands.y ? 1u : 2u;
    return chosen == 2u && bands.z <= 0.0 ? (bands.y > 0.0 ? 1u : 0u) : chosen;
}

// Transmittances as multiples of that of a band with the coefficient `reference`.
vec3 relative_transmittance(vec3 sigma_t, float reference, float t) {
    return exp(clamp((reference - sigma_t) * t, vec3(-EXPONENT_MAX), vec3(EXPONENT_MAX)));
}

vec3 transmittance(vec3 sigma_t, float t) { return exp(-sigma_t * t); }

struct FreeFlight {
    float t;        // of the collision, or t_max
    bool collides;
    vec3 weight;    // of the throughput, scattering coefficient included
    vec3 bands;     // as they are afterwards
};

// A flight of at most t_max (FAR_AWAY: to infinity) through a homogeneous medium.
FreeFlight sample_free_flight(vec3 sigma_s, vec3 sigma_t, vec3 bands, float t_max, vec2 u) {
    float reference = sigma_t[choose_band(bands, u.y)];
    float t = reference > 0.0 ? -log(1.0 - u.x) / reference : FAR_AWAY;
    FreeFlight f;
    f.collides = t < t_max;
    f.t = min(t, t_max);
    vec3 e = relative_transmittance(sigma_t, reference, f.t);
    vec3 share = f.collides ? sigma_t * e : e;
    float density = dot(bands, share);
    f.weight = (f.collides ? sigma_s * e : e) / density;
    f.bands = bands * share / density;
    return f;
}

// Density per metre of collisions of sample_free_flight.
float collision_density(vec3 sigma_t, vec3 bands, float t) { return dot(bands, sigma_t * transmittance(sigma_t, t)); }

// The integral of the transmittance from 0 to t.
float attenuated_length(float sigma_t, float t) {
    float x = sigma_t * t;
    return x < SERIES_DEPTH ? t * (1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0)))) : (1.0 - exp(-x)) / sigma_t;
}

// A place of a light by a ray: `along` the ray (from the start of the segment) and `off` it.
struct EquiAngular {
    float along;
    float off;
    float range;  // angle that the segment subtends at the light; 0 where there is nothing to sample
};

EquiAngular equi_angular(vec3 start, vec3 direction, float t_max, vec3 light) {
    EquiAngular e;
    vec3 to = light - start;
    e.along = dot(to, direction);
    e.off = length(to - e.along * direction);
    e.range = t_max >= FAR_AWAY ? atan(e.off, -e.along) : atan(e.off * t_max, e.off * e.off - e.along * (t_max - e.along));
    e.range = e.off > 0.0 ? e.range : 0.0;
    return e;
}

float equi_angular_sample(EquiAngular e, float t_max, float u) {
    float angle = u * e.range;
    float s = sin(angle);
    // Nothing is left of it, or less, where the end is infinitely far or rounding leads past it.
    float depth = e.off * cos(angle) + e.along * s;
    return depth > 0.0 ? clamp(s * (e.off * e.off + e.along * e.along) / depth, 0.0, t_max) : t_max;
}

float equi_angular_pdf(EquiAngular e, float t) {
    float d = t - e.along;
    return e.range > 0.0 ? e.off / (e.range * (e.off * e.off + d * d)) : 0.0;
}

// Whether a sample of the segment is worth a ray of its own beside the collision of a free flight, whose density is at most `extinction`: by the
// densities where the segment is nearest to the light. Of an endless ray that is the case within two thirds of a mean free path.
bool equi_angular_helps(EquiAngular e, float t_max, float extinction) {
    return equi_angular_pdf(e, clamp(e.along, 0.0, t_max)) > EQUI_ANGULAR_GAIN * extinction;
}

// A tentative collision with an extinction of `real` (at most 1) shares of the majorant: whether u in [0, 1) makes it a real one. Multiplies
// the throughput's weight, by `scattered` (the scattering coefficient in the same unit) where it does.
bool sample_null_collision(vec3 real, vec3 scattered, float u, inout vec3 bands, inout vec3 weight) {
    float probability = dot(bands, real);
    float null_probability = dot(bands, 1.0 - real);
    // Rounded, the two may sum to less than the greatest u.
    bool collides = u < probability || null_probability <= 0.0;
    vec3 share = collides ? real : 1.0 - real;
    float inverse = 1.0 / (collides ? probability : null_probability);
    weight *= (collides ? scattered : share) * inverse;
    bands *= share * inverse;
    return collides;
}

#endif
