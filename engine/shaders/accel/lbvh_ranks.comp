// Nodes of the linear hierarchy that stay before each node.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh_ranks.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhKept { uint lbvh_kept[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhBlocks { uint lbvh_blocks[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer LbvhRanks { uint lbvh_ranks[]; };

layout(push_constant, scalar) uniform LbvhRankPush { uint count; } lbvh_push;

void main() {
    uvec2 range = lbvh_rank_block(gl_GlobalInvocationID.x, lbvh_push.count);
    uint before = lbvh_blocks[gl_GlobalInvocationID.x];
    for (uint i = range.x; i < range.y; ++i) {
        lbvh_ranks[i] = before;
        before += lbvh_kept[i];
    }
}
