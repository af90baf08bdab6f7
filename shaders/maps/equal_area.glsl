// The equal-area octahedron map in [-1, 1]^2. Sources and guarantees: maps/equal_area.rs.
#ifndef CLERESTORY_MAPS_EQUAL_AREA_GLSL
#define CLERESTORY_MAPS_EQUAL_AREA_GLSL

#include "maps/octahedron.glsl"
#include "maps/turn.glsl"
#include "pi.glsl"

// Of a unit direction.
vec2 equal_area_encode(vec3 d) {
    vec3 a = abs(d);
    float r = length(d.xy) * inversesqrt(1.0 + a.z);
    float quarters = 4.0 * vector_turn(a.xy);
    vec2 p = vec2(r - r * quarters, r * quarters);
    return (d.z < 0.0 ? 1.0 - p.yx : p) * octahedron_signs(d.xy);
}

vec3 equal_area_decode(vec2 uv) {
    vec2 a = abs(uv);
    float h = 1.0 - a.x - a.y;
    float r = 1.0 - abs(h);
    vec2 along = turn_vector(r > 0.0 ? 0.125 * ((a.y - a.x) / r + 1.0) : 0.0);
    float z = 1.0 - r * r;
    return vec3(r * sqrt(max(2.0 - r * r, 0.0)) * along * octahedron_signs(uv), h < 0.0 ? -z : z);
}

// Solid angle over area.
float equal_area_density(vec2 uv) { return PI; }

#endif
