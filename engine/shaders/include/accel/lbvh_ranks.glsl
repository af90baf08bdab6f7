// Blocks of nodes that an invocation counts alone: ranks by reduce, scan, and count again.
#ifndef CLERESTORY_ACCEL_LBVH_RANKS_GLSL
#define CLERESTORY_ACCEL_LBVH_RANKS_GLSL

#include "accel/lbvh.glsl"

const uint LBVH_RANK_BLOCKS = LBVH_GROUP_SIZE * LBVH_GROUP_SIZE;

// First and end of a block of `count` nodes.
uvec2 lbvh_rank_block(uint block, uint count) {
    uint size = (count + LBVH_RANK_BLOCKS - 1u) / LBVH_RANK_BLOCKS;
    return min(uvec2(block * size, (block + 1u) * size), uvec2(count));
}

#endif
