// Look-ups in a map of directions: set 1, filled by clerestory::maps::directional_map::DirectionalMap.
#ifndef CLERESTORY_MAPS_DIRECTIONAL_MAP_SET_GLSL
#define CLERESTORY_MAPS_DIRECTIONAL_MAP_SET_GLSL

#include "maps/directional_map.glsl"

// descriptor set 1: DirectionalMapSet

layout(set = 1, binding = 0, scalar) restrict readonly buffer MapLevels { MapLevel map_levels[]; };
layout(set = 1, binding = 1, scalar) restrict readonly buffer MapTexels { vec3 map_texels[]; };
// Of texels, sr.
layout(set = 1, binding = 2, scalar) restrict readonly buffer MapAngles { float map_angles[]; };

// A texel up to one outside the level.
vec3 directional_fetch(MapLevel level, ivec2 p) {
    if (DIRECTIONAL_BORDER == 0 && (min(p.x, p.y) < 0 || any(greaterThanEqual(p, level.size)))) {
        p = directional_wrap(p, level.size);
    }
    return map_texels[directional_texel(level, p)];
}

// Of a map without borders: beyond corners of the cube and rims of discs, texels that are there share the weight of those that are not.
vec3 directional_shared(uint layer, vec2 uv, uint index) {
    MapLevel level = map_levels[index];
    vec2 place = uv * vec2(level.size) - 0.5;
    vec2 corner = floor(place);
    vec2 part = place - corner;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 s = ivec2(i & 1, i >> 1);
        ivec2 p = ivec2(corner) + s;
        vec2 w = mix(1.0 - part, part, equal(s, ivec2(1)));
        uint on = layer;
        if (directional_find(on, p, level.size)) {
            sum += w.x * w.y * vec4(map_texels[directional_texel(level, on, p)], 1.0);
        }
    }
    // At the rim of a disc of few texels: the one that holds it.
    ivec2 nearest = clamp(ivec2(uv * vec2(level.size)), ivec2(0), level.size - 1);
    return sum.a > 0.0 ? sum.rgb / sum.a : map_texels[directional_texel(level, layer, nearest)];
}

// At coordinates in [0, 1]^2 of a layer, over seams as if there were none.
vec3 directional_bilinear(uint layer, vec2 uv, uint index) {
    if (DIRECTIONAL_KIND >= DIRECTIONAL_CUBE) {
        return directional_shared(layer, uv, index);
    }
    MapLevel level = map_levels[index];
    vec2 place = uv * vec2(level.size) - 0.5;
    vec2 corner = floor(place);
    vec2 part = place - corner;
    ivec2 p = ivec2(corner);
    vec3 upper = mix(directional_fetch(level, p), directional_fetch(level, p + ivec2(1, 0)), part.x);
    vec3 lower = mix(directional_fetch(level, p + ivec2(0, 1)), directional_fetch(level, p + ivec2(1, 1)), part.x);
    return mix(upper, lower, part.y);
}

// Between the two levels about one, clamped to those that there are.
vec3 directional_trilinear(uint layer, vec2 uv, float level) {
    uint last = uint(map_levels.length()) - 1u;
    float clamped = clamp(level, 0.0, float(last));
    uint fine = uint(clamped);
    vec3 value = directional_bilinear(layer, uv, fine);
    float part = clamped - float(fine);
    return part > 0.0 ? mix(value, directional_bilinear(layer, uv, min(fine + 1u, last)), part) : value;
}

// Of a unit direction of the map's axes; black below the horizon of Nusselt's map.
vec3 directional_look_up(vec3 d, float level) {
    if (DIRECTIONAL_KIND == DIRECTIONAL_NUSSELT && d.z < 0.0) {
        return vec3(0.0);
    }
    uint layer;
    vec2 uv = directional_encode(d, layer);
    return directional_trilinear(layer, uv, level);
}

#endif
