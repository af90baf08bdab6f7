// Chains that look for virtual lights which bring light to the picture: a state is a pixel and a light of the pool, and what it brings is the chain's density.
//
// SVO-G5: B. Segovia, J.-C. Iehl and B. Péroche, "Metropolis Instant Radiosity", 2007; J. Liu, F. Liang and W. Wong, "The Multiple-Try Method and Local Optimization in Metropolis
// Sampling", 2000. Expects, declared before the inclusion, the buffer `metropolis_tries` and a block `push` with `tries` and `seed`.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_METROPOLIS_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_METROPOLIS_GLSL

#include "techniques/instant_radiosity/resampling.glsl"
#include "transport/random.glsl"

// What tries are of.
const uint METROPOLIS_SEEDS = 0u;       // anywhere
const uint METROPOLIS_PROPOSALS = 1u;   // about the states of chains
const uint METROPOLIS_REFERENCES = 2u;  // about the proposals that chains have chosen
const uint METROPOLIS_POWERS = 3u;      // lights that were chosen, at pixels all over the picture

// Tells the numbers of choices and acceptance from those of tries.
const uint METROPOLIS_CHOICES = 4u;

uvec4 metropolis_words(uint index, uint step, uint what) { return pcg4d(uvec4(index, step, what, push.seed)); }

// The proposal that a chain chooses by what each brings; the first where none brings anything.
uint chosen_try(uint chain, uint step, out float sum) {
    sum = 0.0;
    uint chosen = 0u;
    uvec4 words = metropolis_words(chain, step, METROPOLIS_CHOICES);
    for (uint i = 0u; i < push.tries; ++i) {
        words = pcg4d(words);
        chosen = resample(unit_float(words.x), metropolis_tries[chain * push.tries + i].brings, sum) ? i : chosen;
    }
    return chosen;
}

#endif
