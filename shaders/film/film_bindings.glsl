// The film on the device: set 3, filled by clerestory::film::GpuFilm, a band of pixels at a time.
#ifndef CLERESTORY_FILM_FILM_BINDINGS_GLSL
#define CLERESTORY_FILM_FILM_BINDINGS_GLSL

#include "film/film_pixel.glsl"

// descriptor set 3: FilmSet

layout(set = 3, binding = 0, scalar) restrict buffer FilmPixels { FilmPixel film_pixels[]; };
layout(set = 3, binding = 1, scalar) restrict buffer FilmAovs { FilmAov film_aovs[]; };

#endif
