// Where the map of an impostor shows a direction.
#ifndef CLERESTORY_MAPS_IMPOSTOR_ENCODE_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_ENCODE_GLSL

#include "maps/directional_map.glsl"

// Face, and coordinates in [0, 1]^2, of l, of length `size`.
vec2 impostor_encode(vec3 l, float size, out uint face) {
    // The other maps that impostors have take directions of any length.
    return directional_encode(DIRECTIONAL_KIND == DIRECTIONAL_EQUAL_AREA && size > 0.0 ? l / size : l, face);
}

#endif
