// Light of virtual lights over the colour of what it lights, so that light of pixels that show one surface can be mixed and their colours are not.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_LIGHT_COLOR_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_LIGHT_COLOR_GLSL

// By what light is divided before it is mixed: a surface's colour, and nothing where it has none.
vec3 divisor(vec3 color) { return mix(vec3(1.0), color, greaterThan(color, vec3(0.0))); }

#endif
