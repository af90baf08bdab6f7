// Fluxes as records keep them. Expects a push-constant block `push` with a WalkKey `key`.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FLUX_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FLUX_GLSL

#include "accel/ray.glsl"
#include "transport/random.glsl"
#include "transport/surface.glsl"

// Steps of a band in a record, over the power of two below the largest band (packing.glsl).
const float FLUX_STEP_SHARE = 1.0 / 256.0;
// Below this power of two steps are the same.
const float FLUX_STEP_LEAST_POWER = 1.0 / 65536.0;

// The flux with noise of a step of its record's bands, so that rounding errs by nothing on average: photons of one history share their flux.
vec3 dithered_flux(vec3 flux, uint slot, uint bounce) {
    uvec3 bits = pcg4d(uvec4(push.key.first_index + slot, bounce, push.key.first_sequence, push.key.seed)).xyz;
    float below = max(uintBitsToFloat(floatBitsToUint(largest_component(flux)) & EXPONENT_BITS), FLUX_STEP_LEAST_POWER);
    vec3 noise = vec3(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z)) - 0.5;
    return max(flux + noise * (FLUX_STEP_SHARE * below), vec3(0.0));
}

#endif
