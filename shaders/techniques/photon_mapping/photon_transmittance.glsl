// What is left of light along a ray through a grid, by ratio tracking of so few steps that a ray keeps all of them: the product of the steps before a place is an unbiased estimate of the
// transmittance to there, for each place of the ray.
//
// A tentative collision that is real with little probability is no step at all most of the time, and a greater one for it; when all steps but a few are taken, bands end by chance at
// real collisions (delta tracking), which takes one step a band at most. Transmittances near zero are decided by roulette. Each keeps the expectation.
//
// J. Novák, A. Selle and W. Jarosz, "Residual Ratio Tracking for Estimating Attenuation in Participating Media", 2014. Twin of
// clerestory::techniques::photon_mapping::volume::transmittance. Guarantees: at most WAY_STEPS steps.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_TRANSMITTANCE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_TRANSMITTANCE_GLSL

#include "transport/medium.glsl"

// Steps of a ray, at most; those that are left for bands to end, and the least share of light that others take from the band that loses most.
const uint WAY_STEPS = 16u;
const uint WAY_STEPS_OF_BANDS = 3u;
const float WAY_STEP_LEAST = 0.25;
// Places of a table of the transmittance, which has the room of the steps.
const uint WAY_PLACES = 4u * WAY_STEPS;

// What a tentative collision leaves of the light that has `passed`, behind so many steps, and whether that is a step. Of each band's light the share `real` (at most 1) ends there on
// average; u in [0, 1)^2.
bool attenuate(vec3 real, uint steps, vec2 u, inout vec3 passed) {
    real = mix(real, vec3(0.0), equal(passed, vec3(0.0)));
    if (steps + WAY_STEPS_OF_BANDS >= WAY_STEPS) {
        bvec3 ends = lessThan(vec3(u.x), real);
        passed = mix(passed, vec3(0.0), ends);
        return any(ends);
    }
    float chance = min(max(real.x, max(real.y, real.z)) / WAY_STEP_LEAST, 1.0);
    if (!(u.x < chance)) {
        return false;
    }
    passed *= 1.0 - real / chance;
    if (max(passed.x, max(passed.y, passed.z)) < RATIO_ROULETTE_BELOW) {
        passed *= u.y < RATIO_ROULETTE_SURVIVAL ? 1.0 / RATIO_ROULETTE_SURVIVAL : 0.0;
    }
    return true;
}

#endif
