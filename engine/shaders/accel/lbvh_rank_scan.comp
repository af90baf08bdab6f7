// One workgroup: nodes of the linear hierarchy that stay before each block.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh_ranks.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict buffer LbvhBlocks { uint lbvh_blocks[]; };

shared uint lane_sums[LBVH_GROUP_SIZE];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint first = lane * LBVH_GROUP_SIZE;
    uint sum = 0u;
    for (uint i = 0u; i < LBVH_GROUP_SIZE; ++i) {
        sum += lbvh_blocks[first + i];
    }
    lane_sums[lane] = sum;
    barrier();
    uint before = 0u;
    for (uint i = 0u; i < lane; ++i) {
        before += lane_sums[i];
    }
    for (uint i = 0u; i < LBVH_GROUP_SIZE; ++i) {
        uint own = lbvh_blocks[first + i];
        lbvh_blocks[first + i] = before;
        before += own;
    }
}
