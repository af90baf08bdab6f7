// What photons need beside what surfaces do (transport/features.glsl), as specialization constants.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FEATURES_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_FEATURES_GLSL

layout(constant_id = 40) const bool HAS_DIFFERENTIALS = true;  // kernels follow the photons' footprints
layout(constant_id = 41) const bool TELLS_CAUSTICS = false;    // whether a photon was scattered diffusely matters
// One number of each photon decides all of its roulettes; those of a pass are spread evenly, so that as many survive as probabilities say (Keller 1997).
layout(constant_id = 49) const bool EVEN_SURVIVAL = false;
layout(constant_id = 48) const bool STORES_LIGHTS = false;     // deposits become virtual lights
layout(constant_id = 58) const bool ONLY_ROUGH = false;        // photons are scattered by diffuse and glossy lobes alone

// Photons carry how far their light is from their first scattering, by which records in media share their light with eye paths that go on (transport/photon_share.glsl).
layout(constant_id = 50) const bool CARRIES_LIGHT_DISTANCE = false;

layout(constant_id = 54) const bool HAS_CLASSES = false;       // the path set is an expression, which tells photons apart by their class

#endif
