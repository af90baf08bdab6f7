#version 460
// Radiance of what rays meet by an impostor of one layer without normals, one ray an invocation; texels are the nearest. What layouts of texels are measured
// by: maps/impostor/layouts.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/directional_map.glsl"

// Whether distances are the fourth numbers of texels, instead of in a buffer of their own.
layout(constant_id = 135) const bool IMPOSTOR_PACKED = false;

layout(push_constant, scalar) uniform Push {
    ivec2 size;       // texels of a layer of the map
    vec2 extent;      // least and greatest distance of a surface
    uint count;
    float tolerance;  // greatest residual of a surface
} push;

// A ray from the map's place, with a unit direction.
struct ImpostorQuery {
    vec3 origin;
    vec3 direction;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ImpostorQuery queries[]; };
// Radiance, and the distance.
layout(set = 0, binding = 1) uniform textureBuffer texels;
layout(set = 0, binding = 2) uniform textureBuffer distances;
layout(set = 0, binding = 3, scalar) restrict writeonly buffer Values { vec3 values[]; };

float impostor_distance(uint layer, vec3 v);

#include "maps/impostor.glsl"

// The texel that shows a unit direction.
int impostor_texel(vec3 v) {
    uint face;
    vec2 uv = directional_encode(v, face);
    ivec2 p = clamp(ivec2(uv * vec2(push.size)), ivec2(0), push.size - 1);
    return (int(face) * push.size.y + p.y) * push.size.x + p.x;
}

float impostor_distance(uint layer, vec3 v) {
    int texel = impostor_texel(v);
    return IMPOSTOR_PACKED ? texelFetch(texels, texel).w : texelFetch(distances, texel).x;
}

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ImpostorQuery query = queries[i];
        ImpostorHit hit = impostor_search(query.origin, query.direction, push.extent, push.tolerance);
        values[i] = texelFetch(texels, impostor_texel(hit.direction)).rgb;
    }
}
