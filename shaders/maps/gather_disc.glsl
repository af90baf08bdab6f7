// Solid angles of discs, and reflectivities of cones from a table. Sources and guarantees: maps/gather/mod.rs. Expects
// `float gather_table_value(uint)`.
#ifndef CLERESTORY_MAPS_GATHER_DISC_GLSL
#define CLERESTORY_MAPS_GATHER_DISC_GLSL

#include "pi.glsl"

// Sizes, and angles, of the table of reflectivities.
const uint GATHER_TABLE_SIDE = 64u;

// 2 pi (1 - 1 / sqrt(1 + t)), without the difference that cancels for small t, and without products that overflow for great ones.
float gather_disc(float t) {
    float root = sqrt(1.0 + t);
    return isinf(t) ? 2.0 * PI : 2.0 * PI / (root + 1.0) * (t / root);
}

// Mean of a lobe over a cone, by the cosines of the cone's half angle and of its axis with the lobe's; rows of the table are even in the root of half the
// latter's distance from 1.
float gather_reflectivity(float cone, float axis) {
    float last = float(GATHER_TABLE_SIDE - 1u);
    vec2 place = last * vec2(clamp(cone, 0.0, 1.0), sqrt(clamp(0.5 - 0.5 * axis, 0.0, 1.0)));
    vec2 corner = min(floor(place), vec2(last - 1.0));
    vec2 part = place - corner;
    uint first = uint(corner.y) * GATHER_TABLE_SIDE + uint(corner.x);
    float upper = mix(gather_table_value(first), gather_table_value(first + 1u), part.x);
    float lower = mix(gather_table_value(first + GATHER_TABLE_SIDE), gather_table_value(first + GATHER_TABLE_SIDE + 1u), part.x);
    return mix(upper, lower, part.y);
}

#endif
