// Random numbers of a walk. Expects: a push-constant block `push` with a WalkKey `key`, and where walks may have numbers of their own, `CLERESTORY_NUMBERED`, a
// bool constant that says whether they do.
#ifndef CLERESTORY_WALK_DRAWS_GLSL
#define CLERESTORY_WALK_DRAWS_GLSL

#include "transport/random.glsl"
#include "walk/dimensions.glsl"
#include "walk/wave.glsl"

#ifndef CLERESTORY_NUMBERED
#define CLERESTORY_NUMBERED false
#endif

// The sequence of the walk in a slot, and its place there.
uint walk_sequence(uint slot) {
    if (CLERESTORY_NUMBERED) {
        return texelFetch(walk_numbers_in, int(slot)).x;
    }
    return push.key.first_sequence + slot / push.key.indices;
}
uint walk_index(uint slot) {
    if (CLERESTORY_NUMBERED) {
        return texelFetch(walk_numbers_in, int(slot)).y;
    }
    return push.key.first_index + slot % push.key.indices;
}

// Bounces that the walk has finished.
uint walk_round(uint slot) {
    if (CLERESTORY_NUMBERED) {
        return status.rounds - texelFetch(walk_numbers_in, int(slot)).z;
    }
    return status.rounds;
}

Sampler walk_sampler(uint slot, uint dimension) { return Sampler(walk_sequence(slot), walk_index(slot), dimension, push.key.seed); }

// Two words of a bounce.
uvec2 bounce_words(uint slot, uint bounce, uint dimension) {
    return sampler_bits(walk_sampler(slot, DIMENSION_FIRST_BOUNCE + bounce * DIMENSIONS_PER_BOUNCE + dimension));
}

// Two numbers of a bounce.
vec2 bounce_sample(uint slot, uint bounce, uint dimension) {
    uvec2 words = bounce_words(slot, bounce, dimension);
    return vec2(unit_float(words.x), unit_float(words.y));
}

#endif
