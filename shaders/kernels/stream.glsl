// A stream of elements cut into blocks, one per team: what every reduce-then-scan kernel shares.
//
// A team is one workgroup, or one invocation where barriers cost more than they bring (software drivers). Teams own contiguous blocks in
// order, so what they find is combined in order, and results do not depend on how many there are. The number of teams is bounded, so a
// single dispatch after the first can scan what they found, and no team ever waits for another.
#ifndef CLERESTORY_KERNELS_STREAM_GLSL
#define CLERESTORY_KERNELS_STREAM_GLSL

// In place of a count: it is in the header of the scratch memory, where the kernel `stream_prepare` has put it.
const uint STREAM_COUNT_ON_DEVICE = 0xFFFFFFFFu;
// Words of the scratch memory before those of the kernel itself.
const uint STREAM_HEADER_WORDS = 16u;

struct StreamPlan {
    uint count;      // elements, or STREAM_COUNT_ON_DEVICE
    uint tile;       // elements that blocks are a multiple of
    uint max_teams;
};

// Elements of a team's block.
uint stream_block(uint count, uint tile, uint max_teams) {
    uint tiles = count / tile + (count % tile != 0u ? 1u : 0u);
    uint each = tiles / max_teams + (tiles % max_teams != 0u ? 1u : 0u);
    return max(each, 1u) * tile;
}

// Teams that have a block.
uint stream_teams(uint count, uint block) { return count / block + (count % block != 0u ? 1u : 0u); }

// First element of a team's block and the one past its last.
uvec2 stream_range(uint team, uint count, uint block) {
    // The product may pass 2^32 for teams without a block only.
    uint first = team < stream_teams(count, block) ? team * block : count;
    return uvec2(first, first + min(block, count - first));
}

#endif
