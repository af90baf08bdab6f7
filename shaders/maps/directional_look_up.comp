#version 460
// Look-ups in a map of directions, one per query.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/directional_map_set.glsl"

layout(push_constant, scalar) uniform Push { uint count; } push;

// Unit direction and level of detail.
layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { vec4 queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Values { vec3 values[]; };

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        vec4 query = queries[i];
        values[i] = directional_look_up(query.xyz, query.w);
    }
}
