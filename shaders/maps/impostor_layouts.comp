#version 460
// Radiance of what rays meet by an impostor of one layer without normals, one ray an invocation; texels are the nearest. What layouts of texels are measured
// by: maps/impostor/layouts.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/impostor_encode.glsl"
#include "maps/impostor_query.glsl"

// Whether one over the distance is the fourth number of a texel, instead of in a buffer of its own.
layout(constant_id = 135) const bool IMPOSTOR_PACKED = false;

layout(push_constant, scalar) uniform Push {
    ivec2 size;       // texels of a layer of the map
    vec2 extent;      // least and greatest distance of a surface
    uint count;
    float tolerance;  // greatest residual of a surface
} push;

// Rays from the map's place.
layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ImpostorQuery queries[]; };
// Radiance, and one over the distance.
layout(set = 0, binding = 1) uniform textureBuffer texels;
layout(set = 0, binding = 2) uniform textureBuffer inverses;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer Values { vec3 values[]; };

float impostor_look_up(uint layer, vec3 l, float size);

#include "maps/impostor.glsl"

// The texel that shows a direction of any length.
int impostor_texel(vec3 l, float size) {
    uint face;
    vec2 uv = impostor_encode(l, size, face);
    ivec2 p = clamp(ivec2(uv * vec2(push.size)), ivec2(0), push.size - 1);
    return (int(face) * push.size.y + p.y) * push.size.x + p.x;
}

float impostor_look_up(uint layer, vec3 l, float size) {
    int texel = impostor_texel(l, size);
    return size * (IMPOSTOR_PACKED ? texelFetch(texels, texel).w : texelFetch(inverses, texel).x);
}

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ImpostorQuery query = queries[i];
        float size;
        ImpostorHit hit = impostor_search(query.origin, query.direction, push.extent, push.tolerance, size);
        values[i] = texelFetch(texels, impostor_texel(hit.direction, size)).rgb;
    }
}
