#version 460
// Means over boxes about directions by a summed-area table, one per query.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/directional_map.glsl"
#include "maps/spherical_sat.glsl"

layout(push_constant, scalar) uniform Push { uint count; } push;

// Unit direction, and half the box's side over that of the map.
layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { vec4 queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Values { vec3 values[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < push.count) {
        vec4 query = queries[i];
        values[i] = sat_mean(directional_encode(query.xyz), query.w);
    }
}
