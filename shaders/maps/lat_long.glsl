// The latitude-longitude map about z. Sources and guarantees: maps/lat_long.rs.
#ifndef CLERESTORY_MAPS_LAT_LONG_GLSL
#define CLERESTORY_MAPS_LAT_LONG_GLSL

#include "maps/turn.glsl"
#include "pi.glsl"

// In [0, 1]^2, of a direction of any length.
vec2 lat_long_encode(vec3 d) {
    float turn = vector_turn(d.xy);
    return vec2(turn < 0.0 ? turn + 1.0 : turn, 2.0 * vector_turn(vec2(d.z, length(d.xy))));
}

vec3 lat_long_decode(vec2 uv) {
    vec2 down = turn_vector(0.5 * uv.y);
    return vec3(turn_vector(uv.x) * down.y, down.x);
}

// Solid angle over area.
float lat_long_density(vec2 uv) { return 2.0 * PI * PI * turn_vector(0.5 * uv.y).y; }

// The mean density of the row of texels at a pole, where it falls to 0.
float lat_long_pole_density(float rows) {
    float sine = turn_vector(0.25 / rows).y;
    return 4.0 * PI * rows * sine * sine;
}

#endif
