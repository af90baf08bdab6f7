// Look-ups of distances in an impostor: set 1, filled by clerestory::maps::impostor::Impostor.
#ifndef CLERESTORY_MAPS_IMPOSTOR_SET_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_SET_GLSL

#include "maps/impostor_encode.glsl"
#include "maps/packed_direction.glsl"

// descriptor set 1: ImpostorSet

// What a texel holds.
const uint IMPOSTOR_HOLDS_DISTANCE = 0u;  // one over the distance
const uint IMPOSTOR_HOLDS_NORMAL = 1u;    // and the normal, packed, so that the distance goes on along the plane
const uint IMPOSTOR_HOLDS_PLANE = 2u;     // the plane as look-ups take it: impostor_plane
layout(constant_id = 134) const uint IMPOSTOR_HOLDS = IMPOSTOR_HOLDS_DISTANCE;

// Texels of a layer of the map, and the least and greatest distance of a surface.
struct ImpostorShape {
    ivec2 size;
    vec2 extent;
};

layout(set = 1, binding = 0, scalar) restrict readonly buffer ImpostorShapes { ImpostorShape impostor_shapes[]; };
// Layer of surfaces by layer, each layer by layer of the map, row by row.
layout(set = 1, binding = 1) uniform utextureBuffer impostor_texels;

float impostor_look_up(uint layer, vec3 l, float size);

#include "maps/impostor.glsl"

// Read once, for all steps, and before lanes part: a software driver loads what they share once.
ivec2 impostor_size = impostor_shapes[0].size;
vec2 impostor_extent = impostor_shapes[0].extent;

float impostor_look_up(uint layer, vec3 l, float size) {
    uint face;
    vec2 uv = impostor_encode(l, size, face);
    ivec2 p = min(ivec2(uv * vec2(impostor_size)), impostor_size - 1);
    bool is_cube = DIRECTIONAL_KIND == DIRECTIONAL_CUBE;
    int row = int(layer * (is_cube ? CUBE_FACES : 1u) + face) * impostor_size.y + p.y;
    uvec4 texel = texelFetch(impostor_texels, row * impostor_size.x + p.x);
    if (IMPOSTOR_HOLDS == IMPOSTOR_HOLDS_PLANE) {
        return impostor_plane_ratio(uintBitsToFloat(texel), l, size);
    }
    float inverse = uintBitsToFloat(texel.x);
    if (IMPOSTOR_HOLDS == IMPOSTOR_HOLDS_NORMAL && (!IMPOSTOR_IS_OPEN || inverse > IMPOSTOR_NOTHING_INVERSE)) {
        vec2 centre = (vec2(p) + 0.5) / vec2(impostor_size);
        vec3 c = is_cube ? cube_decode(face, 2.0 * centre - 1.0) : directional_decode(centre);
        vec3 n = unpack_octahedral(texel.y, PACKED_NORMAL_BITS);
        return impostor_plane_ratio(impostor_plane(inverse, n, c), l, size);
    }
    return inverse * size;
}

#endif
