// What a film keeps for each pixel.
#ifndef CLERESTORY_FILM_FILM_PIXEL_GLSL
#define CLERESTORY_FILM_FILM_PIXEL_GLSL

#include "film/two_float.glsl"

// Sums over the samples of one pixel; squares for the variance.
struct FilmPixel {
    TwoFloat sum[3];
    TwoFloat square[3];
    uint samples;
    uint nan_samples;       // left out
    uint infinite_samples;  // left out
};

// First channels of the AOVs in FilmAov, and their number.
const uint AOV_ALBEDO = 0u;
const uint AOV_NORMAL = 3u;
const uint AOV_DEPTH = 6u;
const uint AOV_CHANNELS = 7u;

// Sums of albedo, normal and depth over the samples that hit something.
struct FilmAov {
    TwoFloat sum[AOV_CHANNELS];
    uint hits;
};

#endif
