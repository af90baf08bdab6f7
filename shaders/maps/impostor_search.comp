#version 460
// What rays meet by an impostor, one ray an invocation. Sources, bias and guarantees: maps/impostor/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/impostor_set.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
    float tolerance;  // greatest residual of a surface
} push;

// A ray from the map's place, with a unit direction.
struct ImpostorQuery {
    vec3 origin;
    vec3 direction;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ImpostorQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Hits { ImpostorHit hits[]; };

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ImpostorQuery query = queries[i];
        hits[i] = impostor_search(query.origin, query.direction, impostor_extent, push.tolerance);
    }
}
