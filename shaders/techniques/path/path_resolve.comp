#version 460
// Wavefront path tracer, last stage: adds the samples of a wave to their pixels' sums, in the order of the samples, so that the sums do
// not depend on the size of the waves. A sample with a NaN or an infinity is counted by kind and left out.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool WRITE_AOVS = true;

#include "film/film_bindings.glsl"
#include "techniques/path/path_aovs.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_film_pixel;  // of the wave, within this buffer
    uint pixel_count;
    uint sample_count;
} push;

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    if (pixel >= push.pixel_count) {
        return;
    }
    uint target = push.first_film_pixel + pixel;
    FilmPixel film = film_pixels[target];
    for (uint i = 0u; i < push.sample_count; ++i) {
        vec3 radiance = walk_gathered[pixel * push.sample_count + i].radiance;
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
        for (uint i = 0u; i < push.sample_count; ++i) {
            PathAov a = path_aovs[pixel * push.sample_count + i];
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
