// What photons need beside what surfaces do (transport/features.glsl), as specialization constants.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FEATURES_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FEATURES_GLSL

layout(constant_id = 40) const bool HAS_DIFFERENTIALS = true;  // kernels follow the photons' footprints
layout(constant_id = 41) const bool TELLS_CAUSTICS = false;    // whether a photon was scattered diffusely matters
layout(constant_id = 48) const bool STORES_LIGHTS = false;     // deposits become virtual lights

#endif
