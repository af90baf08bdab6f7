// Several maps at several places: the two nearest, and the weight of the second. Sources: maps/impostor/places.rs. Expects
// `vec3 map_place(uint)`.
#ifndef CLERESTORY_MAPS_MAP_PLACES_GLSL
#define CLERESTORY_MAPS_MAP_PLACES_GLSL

// Places at most.
const uint MAP_PLACES_MAX = 16u;
// Farther than any place.
const float MAP_PLACES_FAR = 3e38;

// Of the distances to the three nearest of `count` places.
float map_weight(vec3 near, uint count) {
    vec2 w = count < 2u ? vec2(1.0, 0.0)
           : count == 2u ? near.yx
                         : (near.z - near.xy) * near.yx;
    float sum = w.x + w.y;
    return sum > 0.0 ? w.y / sum : 0.0;
}

// The nearest map, and the second nearest, which has the weight; the nearest again where there is one alone.
uvec2 blended_maps(uint count, vec3 point, out float weight) {
    uvec2 maps = uvec2(0u);
    vec3 near = vec3(MAP_PLACES_FAR);
    for (uint i = 0u; i < count && i < MAP_PLACES_MAX; ++i) {
        float d = distance(map_place(i), point);
        if (d < near.x) {
            maps = uvec2(i, maps.x);
            near = vec3(d, near.xy);
        } else if (d < near.y) {
            maps.y = i;
            near.yz = vec2(d, near.y);
        } else {
            near.z = min(near.z, d);
        }
    }
    weight = map_weight(near, count);
    return count < 2u ? maps.xx : maps;
}

#endif
