// Flights whose distance is drawn by the largest extinction of all bands, which the weights of the others make up for: the baseline of the mixture in transport/medium.glsl,
// in no picture.
//
// PM-DE-9: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 7.3.3. Twin of clerestory::transport::densest_band.
#ifndef CLERESTORY_TRANSPORT_DENSEST_BAND_GLSL
#define CLERESTORY_TRANSPORT_DENSEST_BAND_GLSL

#include "transport/medium.glsl"

// Probability one of the band of the largest extinction, the first of equal ones.
vec3 densest_band(vec3 sigma_t) {
    float most = max(sigma_t.x, max(sigma_t.y, sigma_t.z));
    return sigma_t.x >= most ? vec3(1.0, 0.0, 0.0) : sigma_t.y >= most ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
}

// A flight of at most t_max (FAR_AWAY: to infinity) through a homogeneous medium, by that band alone.
FreeFlight densest_band_flight(vec3 sigma_s, vec3 sigma_t, float t_max, float u) {
    return sample_free_flight(sigma_s, sigma_t, densest_band(sigma_t), t_max, vec2(u, 0.0));
}

// E[w^2] of the weight of flights of sample_free_flight that pass the distance t, 0 for those that do not.
vec3 passed_second_moment(vec3 sigma_t, vec3 bands, float t) { return transmittance(2.0 * sigma_t, t) / dot(bands, transmittance(sigma_t, t)); }

#endif
