#version 460
// Look-ups in the shadow map of a spot or of parallel light, one per query.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/shadow_query.glsl"
#include "raster/view_shadow.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
    uint map;
    int side;
    int width;  // texels; 0 takes the nearest texel alone
    ShadowView view;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ShadowQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Shares { float shares[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer ViewDistances { float view_distances[]; };

#include "raster/view_shadow_set.glsl"

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        ShadowQuery q = queries[i];
        shares[i] = view_shadow_visibility(push.view, push.map, push.side, push.width, q.position, q.normal, q.slack);
    }
}
