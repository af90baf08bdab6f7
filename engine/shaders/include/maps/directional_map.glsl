// A map of one layer in memory: levels, each a tile of texels with its border. Sources and guarantees: maps/directional_map.rs.
#ifndef CLERESTORY_MAPS_DIRECTIONAL_MAP_GLSL
#define CLERESTORY_MAPS_DIRECTIONAL_MAP_GLSL

#include "maps/equal_area.glsl"
#include "maps/lat_long.glsl"
#include "maps/octahedron.glsl"
#include "maps/topology.glsl"

// Which map it is.
const uint DIRECTIONAL_OCTAHEDRON = 0u;
const uint DIRECTIONAL_OCTAHEDRON_RECTANGULAR = 1u;
const uint DIRECTIONAL_EQUAL_AREA = 2u;
const uint DIRECTIONAL_LAT_LONG = 3u;

layout(constant_id = 120) const uint DIRECTIONAL_KIND = DIRECTIONAL_OCTAHEDRON;
// Texels of border about each level.
layout(constant_id = 121) const int DIRECTIONAL_BORDER = 1;

struct MapLevel {
    uint first;        // texel of the tile's corner
    uint first_angle;  // solid angle of the first texel; those have no border
    ivec2 size;
};

// The texel inside that one up to a size outside repeats.
ivec2 directional_wrap(ivec2 p, ivec2 size) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return octahedron_rectangular_wrap(p, size);
    }
    return DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG ? lat_long_wrap(p, size) : octahedron_wrap(p, size);
}

// In [0, 1]^2, of a unit direction.
vec2 directional_encode(vec3 d) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG) {
        return lat_long_encode(d);
    }
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return octahedron_rectangular_encode(d) * vec2(0.25, 0.5) + 0.5;
    }
    return (DIRECTIONAL_KIND == DIRECTIONAL_EQUAL_AREA ? equal_area_encode(d) : octahedron_encode(d)) * 0.5 + 0.5;
}

vec3 directional_decode(vec2 uv) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG) {
        return lat_long_decode(uv);
    }
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return octahedron_rectangular_decode(uv * vec2(4.0, 2.0) - vec2(2.0, 1.0));
    }
    uv = 2.0 * uv - 1.0;
    return DIRECTIONAL_KIND == DIRECTIONAL_EQUAL_AREA ? equal_area_decode(uv) : octahedron_decode(uv);
}

// Where a texel of the tile is, that may be in the border.
uint directional_texel(MapLevel level, ivec2 p) {
    p += DIRECTIONAL_BORDER;
    return level.first + uint(p.y * (level.size.x + 2 * DIRECTIONAL_BORDER) + p.x);
}

uint directional_angle(MapLevel level, ivec2 p) { return level.first_angle + uint(p.y * level.size.x + p.x); }

#endif
