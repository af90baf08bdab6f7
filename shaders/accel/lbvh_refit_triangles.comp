// First stage of refitting: triangles that have moved, into the places that the tree gave them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhOrder { uint lbvh_order[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhCorners { vec3 lbvh_corners[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer LbvhWords { uint lbvh_words[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(push_constant, scalar) uniform LbvhRefitPush { uint count; } lbvh_push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= lbvh_push.count) {
        return;
    }
    uint at = BVH2_NODE_WORDS * lbvh_state.nodes + BVH2_TRIANGLE_WORDS * place;
    uint primitive = lbvh_order[place];
    for (uint corner = 0u; corner < 3u; ++corner) {
        uvec3 bits = floatBitsToUint(lbvh_corners[3u * primitive + corner]);
        for (uint axis = 0u; axis < 3u; ++axis) {
            lbvh_words[at + 3u * corner + axis] = bits[axis];
        }
    }
}
