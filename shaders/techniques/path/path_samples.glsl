// The way of samples to their pixels' sums, in the order of the samples, so that the sums do not depend on the size of the waves. A sample with a NaN or an
// infinity is counted by kind and left out. Expects: `WRITE_AOVS`, a bool constant.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_SAMPLES_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_SAMPLES_GLSL

#include "film/film_bindings.glsl"
#include "techniques/path/path_slots.glsl"
#include "walk/wave.glsl"

// Adds what the paths in `count` neighbouring slots have gathered to a pixel of the film.
void add_samples(uint target, uint first_slot, uint count) {
    FilmPixel film = film_pixels[target];
    for (uint i = 0u; i < count; ++i) {
        vec3 radiance = walk_gathered[first_slot + i].radiance;
        if (any(isnan(radiance))) {
            film.nan_samples += 1u;
            continue;
        }
        if (any(isinf(radiance))) {
            film.infinite_samples += 1u;
            continue;
        }
        film.samples += 1u;
        for (int c = 0; c < 3; ++c) {
            film.sum[c] = two_float_add(film.sum[c], radiance[c]);
            film.square[c] = two_float_add_square(film.square[c], radiance[c]);
        }
    }
    film_pixels[target] = film;
    if (WRITE_AOVS) {
        FilmAov aov = film_aovs[target];
        for (uint i = 0u; i < count; ++i) {
            PathAov a = path_aovs[first_slot + i];
            if (a.filled == 0u) {
                continue;
            }
            aov.hits += 1u;
            for (uint c = 0u; c < 3u; ++c) {
                aov.sum[AOV_ALBEDO + c] = two_float_add(aov.sum[AOV_ALBEDO + c], a.albedo[c]);
                aov.sum[AOV_NORMAL + c] = two_float_add(aov.sum[AOV_NORMAL + c], a.normal[c]);
            }
            aov.sum[AOV_DEPTH] = two_float_add(aov.sum[AOV_DEPTH], a.depth);
        }
        film_aovs[target] = aov;
    }
}

#endif
