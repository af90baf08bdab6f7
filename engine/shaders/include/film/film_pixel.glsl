// What a film keeps for each pixel.
#ifndef CLERESTORY_FILM_FILM_PIXEL_GLSL
#define CLERESTORY_FILM_FILM_PIXEL_GLSL

#include "film/two_float.glsl"

// Sums over the samples of one pixel; squares for the variance.
struct FilmPixel {
    TwoFloat sum[3];
    TwoFloat square[3];
    uint samples;
    uint non_finite;
};

// Sums of albedo, normal and depth over the samples that hit something.
struct FilmAov {
    TwoFloat sum[7];
    uint hits;
};

#endif
