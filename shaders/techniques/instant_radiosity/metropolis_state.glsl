// A state of a chain, or a try of one: a pixel, a light of the pool, and what that brings there.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_METROPOLIS_STATE_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_METROPOLIS_STATE_GLSL

struct MetropolisTry {
    uint pixel;
    uint light;
    float brings;  // luminance, as if the light's walk were the only one
};

#endif
