// What the stages share that build compact sibling pairs (compact_bvh.glsl) over boxes in the order of their Morton codes: the state of a build,
// codes and order, and the boxes of ranges of places.
//
// The tree is the one that splits every range at its codes' highest differing bit and stops at the leaf size; equal codes are never split.
// An inner node stands by its split, the last place of its left child. Before the node of a range, from the root down and left first, come those
// that are split at an earlier place than the range's first, and those that hold the range in their left child: the former are counted by
// prefix sums, the latter on the way down.
#ifndef CLERESTORY_ACCEL_MAP_TREE_GLSL
#define CLERESTORY_ACCEL_MAP_TREE_GLSL

#include "accel/compact_bvh.glsl"
#include "accel/lbvh.glsl"
#include "accel/morton.glsl"

const uint MAP_GROUP_SIZE = 64u;
// Places, or blocks of them, that a block joins.
const uint MAP_BLOCK_BITS = 2u;
const uint MAP_BLOCK = 1u << MAP_BLOCK_BITS;
// Levels of inner nodes: each splits at a lower bit of the codes than the one above.
const uint MAP_LEVELS = 3u * MORTON_30_AXIS_BITS;
// More than the blocks and levels that a range is put together from: up to three blocks at each end of each of 16 levels.
const uint MAP_RANGE_STEPS = 112u;

// Inner nodes of a level stand one behind the other.
struct MapTreeLevel {
    uint groups[3];  // indirect arguments: one invocation per node
    uint count;
    uint begin;
};

// The host writes zeros before the build but for numbers of workgroups along y and z, which are 1, and the leaf size, which may come from
// another kernel instead.
struct MapTreeState {
    MapTreeLevel levels[MAP_LEVELS + 1u];
    uint node_groups[3];  // indirect arguments: one invocation per inner node
    uint nodes;           // inner nodes
    uint leaf_size;
};

// Whether a range of places, both ends included, is one of an inner node.
bool map_splits(uint first, uint last, uint first_code, uint last_code, uint leaf_size) {
    return last - first >= leaf_size && first_code != last_code;
}

#ifdef MAP_CODES
// Sorted; four words per texel.
layout(set = 0, binding = 0) uniform utextureBuffer map_codes;

uint map_code(uint place) { return texelFetch(map_codes, int(place >> 2))[place & 3u]; }
#endif

#ifdef MAP_BOXES
// Boxes as LbvhBox in LBVH_BOX_QUARTERS quarters: of the places, then of blocks of these, blocks of blocks, up to one of all.
layout(set = 0, binding = 1) uniform utextureBuffer map_blocks;

LbvhBox map_block(uint at) {
    ivec4 low = ivec4(texelFetch(map_blocks, int(LBVH_BOX_QUARTERS * at)));
    ivec2 high = ivec2(texelFetch(map_blocks, int(LBVH_BOX_QUARTERS * at + 1u)).xy);
    return LbvhBox(low.xyz, ivec3(low.w, high));
}

// The box of a range of places, both ends included, of so many in all.
LbvhBox map_range(uint first, uint last, uint count) {
    uint end = last + 1u;
    uint base = 0u;
    LbvhBox box = map_block(first);
    for (uint i = 0u; first < end && i < MAP_RANGE_STEPS; ++i) {
        bool takes_first = (first & (MAP_BLOCK - 1u)) != 0u;
        if (takes_first || (end & (MAP_BLOCK - 1u)) != 0u) {
            end -= takes_first ? 0u : 1u;
            box = lbvh_union(box, map_block(base + (takes_first ? first : end)));
            first += takes_first ? 1u : 0u;
        } else {
            base += count;
            count = (count + MAP_BLOCK - 1u) >> MAP_BLOCK_BITS;
            first >>= MAP_BLOCK_BITS;
            end >>= MAP_BLOCK_BITS;
        }
    }
    return box;
}
#endif

#endif
