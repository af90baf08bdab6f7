#version 460
// What rays meet by an impostor, one ray an invocation. Sources, bias and guarantees: maps/impostor/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/impostor_query.glsl"
#include "maps/impostor_set.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
    float tolerance;  // greatest residual of a surface
} push;

// Rays from the map's place, by texels of two numbers, which software drivers fetch for all lanes at once.
layout(set = 0, binding = 0) uniform textureBuffer queries;
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Hits { ImpostorHit hits[]; };

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        int at = int(IMPOSTOR_QUERY_TEXELS * i);
        ImpostorQuery query = impostor_query(
            texelFetch(queries, at).xy,
            texelFetch(queries, at + 1).xy,
            texelFetch(queries, at + 2).xy);
        hits[i] = impostor_search(query.origin, query.direction, impostor_extent, push.tolerance);
    }
}
