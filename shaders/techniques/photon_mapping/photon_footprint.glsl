// Footprints of photons in media: how they pass and scatter there, and how wide a kernel they ask for.
//
// A photon's two vectors span an area across its way; the distance in which as many photons collide as there are in it makes a volume of it, the reciprocal of
// the density of collisions. PM-PD-9 to PM-PD-12, PM-DE-7, PM-DE-8: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 7.2, 7.3.1 and 7.3.2, where the unit
// of lengths is a metre. Twin of clerestory::techniques::photon_mapping::volume::footprint. Guarantee: no length is compared with a constant, only with the unit length.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FOOTPRINT_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FOOTPRINT_GLSL

#include "transport/differentials.glsl"

struct EventKernelSettings {
    float spread;       // times the cube root of the volume, step cbrt(4 pi / n) included
    float dampening;    // cube root, over that of the square of the unit length times the least mean free path, from which on kernels grow slower; 0 for none
    float unit_length;  // m
    float length_min;   // of radii, m
    float length_max;
};

// Below this the logarithm is that of its series.
const float LOG_SERIES_BELOW = 1e-3;
// Least part of photons that is reckoned to come as far.
const float FOOTPRINT_PASSED_MIN = 1e-4;

float log_of_one_plus(float x) { return x < LOG_SERIES_BELOW ? x - 0.5 * x * x : log(1.0 + x); }

// |<z1, z2, w>| after the distance t along w: the area across the way, over that of the step.
float footprint_across(Differentials d, float t, vec3 w) { return abs(dot(cross(d.z1 + t * d.w1, d.z2 + t * d.w2), w)); }

// Radius of the kernel of a collision with a footprint `across`, which had the density `pdf` on its way, per metre; `extinction` is that of the medium at its densest.
float event_radius(EventKernelSettings s, float across, float pdf, float extinction) {
    float unit = s.unit_length;
    float root = pow(across / (unit * unit) * extinction / pdf, 1.0 / 3.0);
    float damped = s.dampening > 0.0 ? s.dampening * log_of_one_plus(root / s.dampening) : root;
    float radius = s.spread * pow(unit * unit / extinction, 1.0 / 3.0) * damped;
    // Also where there is no footprint, or none that is a number.
    return across > 0.0 && pdf > 0.0 && radius < s.length_max ? max(radius, s.length_min) : across > 0.0 ? s.length_max : s.length_min;
}

// After a part of the photons has gone no further.
Differentials passed_differentials(Differentials d, float passed) { return roulette_differentials(d, max(passed, FOOTPRINT_PASSED_MIN)); }

// After scattering into `direction` with the density `phase`, which a share `survival` of photons outlives: as from a point behind, so far that the expected volume
// stays. `here` is the extinction at the collision.
Differentials scattered_in_medium(float across, float pdf, float here, float survival, vec3 direction, float phase) {
    float side = pdf > 0.0 ? sqrt(across * here / (pdf * survival)) : 0.0;
    return reemission_differentials(side, direction, phase, 4.0 * PI);
}

#endif
