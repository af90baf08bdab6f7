#version 460
// The end of a step of each chain: its chosen proposal is accepted by the sum of what all proposals bring over that of what the references and the state do. What
// chains are at in some steps is kept.
//
// SVO-G5: J. Liu, F. Liang and W. Wong, "The Multiple-Try Method and Local Optimization in Metropolis Sampling", 2000, with weights that are densities, for symmetric steps.
// Deterministic in (seed, step, chain).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "techniques/instant_radiosity/metropolis_state.glsl"

layout(push_constant, scalar) uniform Push {
    uint tries;
    uint chains;
    uint step;
    uint seed;
    uint keeps;   // whether lights are kept
    uint first;   // place of the first chain's light
    uint lights;  // that are kept in all
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer MetropolisTries { MetropolisTry metropolis_tries[]; };
layout(set = 0, binding = 1, scalar) restrict buffer MetropolisStates { MetropolisTry metropolis_states[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer MetropolisChosen { uint metropolis_chosen[]; };

#define CLERESTORY_SAMPLER SAMPLER_PCG
#include "techniques/instant_radiosity/metropolis.glsl"

void main() {
    uint chain = invocation_index();
    if (chain >= push.chains) {
        return;
    }
    float proposed;
    uint chosen = chosen_try(chain, push.step, proposed);
    float referred = metropolis_states[chain].brings;
    for (uint i = 0u; i + 1u < push.tries; ++i) {
        referred += metropolis_tries[push.chains * push.tries + chain * (push.tries - 1u) + i].brings;
    }
    uvec4 words = metropolis_words(chain, push.step, METROPOLIS_CHOICES);
    if (unit_float(words.x) * referred < proposed) {
        metropolis_states[chain] = metropolis_tries[chain * push.tries + chosen];
    }
    uint place = push.first + chain;
    if (push.keeps != 0u && place < push.lights) {
        metropolis_chosen[place] = metropolis_states[chain].light;
    }
}
