// Look-ups of distances in an impostor: set 1, filled by clerestory::maps::impostor::Impostor.
#ifndef CLERESTORY_MAPS_IMPOSTOR_SET_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_SET_GLSL

#include "maps/directional_map.glsl"
#include "maps/packed_direction.glsl"

// descriptor set 1: ImpostorSet

// Whether there are normals, so that a texel's distance goes on along its plane.
layout(constant_id = 134) const bool IMPOSTOR_PLANES = false;

// Texels of a layer of the map, and the least and greatest distance of a surface.
struct ImpostorShape {
    ivec2 size;
    vec2 extent;
};

layout(set = 1, binding = 0, scalar) restrict readonly buffer ImpostorShapes { ImpostorShape impostor_shapes[]; };
// Layer of surfaces by layer, each layer by layer of the map, row by row: the distance, and the normal where there are normals.
layout(set = 1, binding = 1) uniform utextureBuffer impostor_texels;

float impostor_distance(uint layer, vec3 v);

#include "maps/impostor.glsl"

// Read once, for all steps.
ivec2 impostor_size = impostor_shapes[0].size;

float impostor_distance(uint layer, vec3 v) {
    uint face;
    vec2 uv = directional_encode(v, face);
    ivec2 p = clamp(ivec2(uv * vec2(impostor_size)), ivec2(0), impostor_size - 1);
    bool is_cube = DIRECTIONAL_KIND == DIRECTIONAL_CUBE;
    int row = int(layer * (is_cube ? CUBE_FACES : 1u) + face) * impostor_size.y + p.y;
    uvec2 texel = texelFetch(impostor_texels, row * impostor_size.x + p.x).xy;
    float distance = uintBitsToFloat(texel.x);
    if (IMPOSTOR_PLANES && (!IMPOSTOR_IS_OPEN || distance < IMPOSTOR_NOTHING)) {
        vec2 centre = (vec2(p) + 0.5) / vec2(impostor_size);
        vec3 c = is_cube ? cube_decode(face, 2.0 * centre - 1.0) : directional_decode(centre);
        vec3 n = unpack_octahedral(texel.y, PACKED_NORMAL_BITS);
        distance = impostor_plane(distance, dot(n, c), dot(n, v));
    }
    return distance;
}

#endif
