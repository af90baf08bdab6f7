// What a pixel keeps of the virtual lights that it has drawn, and the numbers that are drawn by.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RESERVOIR_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RESERVOIR_GLSL

#include "transport/random.glsl"

struct Reservoir {
    uint light;
    float weight;  // of it, so that on average over draws it stands for all lights; 0 where none brings anything
};

// A pixel and its neighbours, at most.
const uint RESERVOIR_MEMBERS_MAX = 9u;
// Tells the numbers that neighbours are found by from those of candidates.
const uint RESERVOIR_NEIGHBOURS = 0x6e656967u;

uvec4 reservoir_words(uint pixel, uint frame, uint number, uint seed) { return pcg4d(uvec4(pixel, frame, number, seed)); }

#endif
