// Directions in a word, by the octahedron map. Sources and guarantees: maps/packed_direction.rs.
#ifndef CLERESTORY_MAPS_PACKED_DIRECTION_GLSL
#define CLERESTORY_MAPS_PACKED_DIRECTION_GLSL

#include "maps/octahedron.glsl"

// Bits of each coordinate of the normals of maps.
const uint PACKED_NORMAL_BITS = 16u;

// A unit vector with so many bits (2 to 16) for each of the two coordinates, the first ones lowest.
uint pack_octahedral(vec3 n, uint bits) {
    vec2 p = octahedron_encode(n);
    float steps = float((1u << (bits - 1u)) - 1u);
    uvec2 q = uvec2(floor(p * steps + 0.5) + steps);
    return q.x | q.y << bits;
}

vec3 unpack_octahedral(uint word, uint bits) {
    float steps = float((1u << (bits - 1u)) - 1u);
    uint mask = (1u << bits) - 1u;
    return octahedron_decode(vec2(uvec2(word, word >> bits) & mask) / steps - 1.0);
}

#endif
