// Between two trees of the linear hierarchy, one invocation: arguments of the dispatches that make the tree again with fewer bits, of no
// workgroups where rays can traverse the one that stands.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"

layout(local_size_x = 1) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhStateBlock { LbvhState lbvh_state; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer LbvhArguments { uint lbvh_arguments[6]; };

layout(push_constant, scalar) uniform LbvhRetryPush {
    // Workgroups of lbvh_hierarchy and of lbvh_climb.
    uint hierarchy_groups;
    uint climb_groups;
    // Inner nodes on a way from the root that rays can follow.
    uint most_depth;
} lbvh_push;

void main() {
    bool is_too_deep = lbvh_state.height > lbvh_push.most_depth;
    lbvh_arguments[0] = is_too_deep ? lbvh_push.hierarchy_groups : 0u;
    lbvh_arguments[3] = is_too_deep ? lbvh_push.climb_groups : 0u;
    for (uint axis = 1u; axis < 3u; ++axis) {
        lbvh_arguments[axis] = 1u;
        lbvh_arguments[3u + axis] = 1u;
    }
}
