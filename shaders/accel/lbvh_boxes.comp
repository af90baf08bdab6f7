// First stage of the linear hierarchy: boxes of the triangles, and the exact bounds of their doubled centres.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhCorners { vec3 lbvh_corners[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer LbvhBoxes { ivec4 lbvh_boxes[]; };
layout(set = 0, binding = 2, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(push_constant, scalar) uniform LbvhBoxesPush { uint count; } lbvh_push;

shared int group_lower[3];
shared int group_upper[3];

void main() {
    uint lane = gl_LocalInvocationID.x;
    if (lane < 3u) {
        group_lower[lane] = 0x7FFFFFFF;
        group_upper[lane] = int(0x80000000u);
    }
    barrier();
    LbvhBox centres = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    uint place = gl_WorkGroupID.x * LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION + lane;
    for (uint i = 0u; i < LBVH_BOXES_PER_INVOCATION && place < lbvh_push.count; ++i) {
        ivec3 a = ordered_integers(lbvh_corners[3u * place]);
        ivec3 b = ordered_integers(lbvh_corners[3u * place + 1u]);
        ivec3 c = ordered_integers(lbvh_corners[3u * place + 2u]);
        LbvhBox box = LbvhBox(min(a, min(b, c)), max(a, max(b, c)));
        lbvh_boxes[LBVH_BOX_QUARTERS * place] = ivec4(box.lower, box.upper.x);
        lbvh_boxes[LBVH_BOX_QUARTERS * place + 1u] = ivec4(box.upper.yz, 0, 0);
        precise vec3 doubled = ordered_floats(box.lower) + ordered_floats(box.upper);
        ivec3 centre = ordered_integers(doubled);
        centres = lbvh_union(centres, LbvhBox(centre, centre));
        place += LBVH_GROUP_SIZE;
    }
    for (uint axis = 0u; axis < 3u; ++axis) {
        atomicMin(group_lower[axis], centres.lower[axis]);
        atomicMax(group_upper[axis], centres.upper[axis]);
    }
    barrier();
    if (lane < 3u) {
        atomicMin(lbvh_state.centres_lower[lane], group_lower[lane]);
        atomicMax(lbvh_state.centres_upper[lane], group_upper[lane]);
    }
}
