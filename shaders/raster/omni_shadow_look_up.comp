#version 460
// Look-ups in an omnidirectional shadow map, one per query.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/omni_shadow_set.glsl"
#include "raster/shadow_query.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 light;
    uint count;
    uint map;
    int side;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ShadowQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Shares { float shares[]; };

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ShadowQuery q = queries[i];
        shares[i] = omni_shadow_visibility(push.map, push.side, push.light, q.position, q.normal, q.slack);
    }
}
