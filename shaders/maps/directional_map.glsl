// A map in memory: levels, each a tile of texels with its border, or several without. Sources and guarantees: maps/directional_map.rs.
#ifndef CLERESTORY_MAPS_DIRECTIONAL_MAP_GLSL
#define CLERESTORY_MAPS_DIRECTIONAL_MAP_GLSL

#include "maps/cube.glsl"
#include "maps/equal_area.glsl"
#include "maps/lat_long.glsl"
#include "maps/nusselt.glsl"
#include "maps/octahedron.glsl"
#include "maps/paraboloid.glsl"
#include "maps/sphere_map.glsl"
#include "maps/topology.glsl"

// Which map it is.
const uint DIRECTIONAL_OCTAHEDRON = 0u;
const uint DIRECTIONAL_OCTAHEDRON_RECTANGULAR = 1u;
const uint DIRECTIONAL_EQUAL_AREA = 2u;
const uint DIRECTIONAL_LAT_LONG = 3u;
// Those without borders: neighbours of a texel may lie on other layers, or be none.
const uint DIRECTIONAL_CUBE = 4u;
const uint DIRECTIONAL_PARABOLOID = 5u;
const uint DIRECTIONAL_SPHERE = 6u;
const uint DIRECTIONAL_NUSSELT = 7u;

layout(constant_id = 120) const uint DIRECTIONAL_KIND = DIRECTIONAL_OCTAHEDRON;
// Texels of border about each level.
layout(constant_id = 121) const int DIRECTIONAL_BORDER = 1;

struct MapLevel {
    uint first;        // texel of the tile's corner
    uint first_angle;  // solid angle of the first texel; those have no border
    ivec2 size;
};

// The texel inside that one up to a size outside repeats, of maps with borders.
ivec2 directional_wrap(ivec2 p, ivec2 size) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return octahedron_rectangular_wrap(p, size);
    }
    return DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG ? lat_long_wrap(p, size) : octahedron_wrap(p, size);
}

// Whether there is a texel at a place up to one outside a layer of a map without borders; layer and place become those of the texel.
bool directional_find(inout uint layer, inout ivec2 p, ivec2 size) {
    bvec2 outside = bvec2(p.x < 0 || p.x >= size.x, p.y < 0 || p.y >= size.y);
    if (DIRECTIONAL_KIND == DIRECTIONAL_CUBE) {
        if (any(outside) && !all(outside)) {
            layer = cube_wrap(layer, p, size.x);
        }
        return !all(outside);
    }
    return !any(outside) && is_on_disc(p, size.x);
}

// Layer, and coordinates in [0, 1]^2, of a unit direction.
vec2 directional_encode(vec3 d, out uint layer) {
    layer = 0u;
    if (DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG) {
        return lat_long_encode(d);
    }
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return octahedron_rectangular_encode(d) * vec2(0.25, 0.5) + 0.5;
    }
    vec2 uv;
    switch (DIRECTIONAL_KIND) {
    case DIRECTIONAL_EQUAL_AREA: uv = equal_area_encode(d); break;
    case DIRECTIONAL_CUBE: uv = cube_encode(d, layer); break;
    case DIRECTIONAL_PARABOLOID: uv = paraboloid_encode(d, layer); break;
    case DIRECTIONAL_SPHERE: uv = sphere_map_encode(d); break;
    case DIRECTIONAL_NUSSELT: uv = nusselt_encode(d); break;
    default: uv = octahedron_encode(d); break;
    }
    return uv * 0.5 + 0.5;
}

// The same of maps with one layer.
vec2 directional_encode(vec3 d) {
    uint layer;
    return directional_encode(d, layer);
}

// Solid angle over area of [0, 1]^2, of maps with borders.
float directional_density(vec2 uv) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_LAT_LONG) {
        return lat_long_density(uv);
    }
    if (DIRECTIONAL_KIND == DIRECTIONAL_OCTAHEDRON_RECTANGULAR) {
        return 8.0 * octahedron_rectangular_density(uv * vec2(4.0, 2.0) - vec2(2.0, 1.0));
    }
    uv = 2.0 * uv - 1.0;
    return 4.0 * (DIRECTIONAL_KIND == DIRECTIONAL_EQUAL_AREA ? equal_area_density(uv) : octahedron_density(uv));
}

// Of maps with borders.
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

// The same of a layer of a map without borders.
uint directional_texel(MapLevel level, uint layer, ivec2 p) {
    return level.first + uint((int(layer) * level.size.y + p.y) * level.size.x + p.x);
}

// The same for all layers.
uint directional_angle(MapLevel level, ivec2 p) { return level.first_angle + uint(p.y * level.size.x + p.x); }

#endif
