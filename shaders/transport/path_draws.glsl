// Random numbers of a path's bounces. Expects: a push-constant block `push` with first_pixel, first_sample, sample_count and seed.
#ifndef CLERESTORY_TRANSPORT_PATH_DRAWS_GLSL
#define CLERESTORY_TRANSPORT_PATH_DRAWS_GLSL

#include "transport/path_dimensions.glsl"
#include "transport/random.glsl"

Sampler path_sampler(uint slot, uint dimension) {
    uint pixel = push.first_pixel + slot / push.sample_count;
    return Sampler(pixel, push.first_sample + slot % push.sample_count, dimension, push.seed);
}

// Two numbers of a bounce.
vec2 bounce_sample(uint slot, uint bounce, uint dimension) {
    Sampler s = path_sampler(slot, DIMENSION_FIRST_BOUNCE + bounce * DIMENSIONS_PER_BOUNCE + dimension);
    return sample_2d(s);
}

#endif
