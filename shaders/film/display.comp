#version 460
// Film to the screen: mean radiance, exposed, clipped and sRGB-encoded, as four bytes per pixel. Pixels without samples are black.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "film/film_pixel.glsl"
#include "srgb.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_pixel;  // of this part of the film, in the picture
    uint pixel_count;
    float scale;       // 2 to the power of the exposure
    uint bgra;         // 1: blue first
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer FilmPixels { FilmPixel film_pixels[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer DisplayPixels { uint display_pixels[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.pixel_count) {
        return;
    }
    FilmPixel film = film_pixels[i];
    float scale = film.samples > 0u ? push.scale / float(film.samples) : 0.0;
    vec3 linear = clamp(vec3(film.sum[0].hi, film.sum[1].hi, film.sum[2].hi) * scale, 0.0, 1.0);
    vec3 srgb = srgb_from_linear(linear);
    display_pixels[push.first_pixel + i] = packUnorm4x8(vec4(push.bgra != 0u ? srgb.bgr : srgb, 1.0));
}
