#version 460
// Lobes about directions by weighted boxes of a summed-area table, one per query. Sources and guarantees: maps/box_lobe.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/box_lobe.glsl"

struct LobeQuery {
    vec3 direction;    // unit
    uint first_box;
    uint box_count;
};

layout(push_constant, scalar) uniform Push { uint count; } push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { LobeQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer Boxes { LobeBox boxes[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer Values { vec3 values[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.count) {
        return;
    }
    LobeQuery query = queries[i];
    vec3 x;
    vec3 y;
    orthonormal_basis(query.direction, x, y);
    vec3 sum = vec3(0.0);
    for (uint j = 0u; j < query.box_count; ++j) {
        LobeBox box = boxes[query.first_box + j];
        vec2 uv = directional_encode(box.direction.x * x + box.direction.y * y + box.direction.z * query.direction);
        sum += box.weight * sat_mean(uv, sat_half_width(uv, box.solid_angle));
    }
    values[i] = sum;
}
