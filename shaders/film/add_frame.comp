#version 460
// Adds a picture to a film: one sample to each pixel. A sample with a NaN or an infinity is counted by kind and left out.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "film/film_bindings.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_pixel;  // of this part of the film, in the picture
    uint pixel_count;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Radiance { vec3 radiance[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.pixel_count) {
        return;
    }
    vec3 light = radiance[push.first_pixel + i];
    if (any(isnan(light))) {
        film_pixels[i].nan_samples += 1u;
        return;
    }
    if (any(isinf(light))) {
        film_pixels[i].infinite_samples += 1u;
        return;
    }
    FilmPixel film = film_pixels[i];
    film.samples += 1u;
    for (int c = 0; c < 3; ++c) {
        film.sum[c] = two_float_add(film.sum[c], light[c]);
        film.square[c] = two_float_add_square(film.square[c], light[c]);
    }
    film_pixels[i] = film;
}
