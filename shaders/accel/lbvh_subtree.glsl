// Subtrees of the linear hierarchy while it is made: how they are handed from child to parent, and joined.
#ifndef CLERESTORY_ACCEL_LBVH_SUBTREE_GLSL
#define CLERESTORY_ACCEL_LBVH_SUBTREE_GLSL

#include "accel/lbvh.glsl"

// Above all levels: beyond the first and the last place.
const uint LBVH_NO_LEVEL = 127u;
const uint LBVH_LEVEL_BITS = 7u;

// What a child tells its parent besides its box.
struct LbvhSummary {
    float cost;
    // Level on the side away from the parent, and in the bits above it the height.
    uint height_level;
    // First place of a left child, last of a right one.
    uint end;
};

struct LbvhSubtree {
    LbvhBox box;
    float cost;
    // Most inner nodes on a way down, 0 for leaves.
    uint height;
    uint first;
    uint last;
    // How far up codes differ before the first place and after the last.
    uint left_level;
    uint right_level;
};

layout(set = 0, binding = 0, scalar) restrict coherent buffer LbvhNodes { int lbvh_nodes[]; };
layout(set = 0, binding = 1, scalar) restrict coherent buffer LbvhSummaries { LbvhSummary lbvh_summaries[]; };
// 1 for nodes that stay, 0 for those inside leaves.
layout(set = 0, binding = 2, scalar) restrict coherent buffer LbvhRetained { uint lbvh_retained[]; };
layout(set = 0, binding = 3, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };
// Nodes that wait for what is below another run: how many of each run, then the first of each run, the second of each run, and so on.
layout(set = 0, binding = 4, scalar) restrict buffer LbvhPending { uint lbvh_pending[]; };

layout(push_constant, scalar) uniform LbvhHierarchyPush {
    uint count;
    uint runs;
    // Lowest bits of the codes that do not count.
    uint skipped;
    uint leaf_size;
} lbvh_push;

// The box of one side of a node; a node is named by the last place of its left child.
void lbvh_store_box(uint node, uint side, LbvhBox box) {
    uint word = 4u * LBVH_NODE_QUARTERS * node + 6u * side;
    lbvh_nodes[word] = box.lower.x;
    lbvh_nodes[word + 1u] = box.lower.y;
    lbvh_nodes[word + 2u] = box.lower.z;
    lbvh_nodes[word + 3u] = box.upper.x;
    lbvh_nodes[word + 4u] = box.upper.y;
    lbvh_nodes[word + 5u] = box.upper.z;
}

// A subtree whose root is `slot`, as a child; leaves are as rays want them, and `slot` is not theirs.
void lbvh_store_child(uint node, uint side, LbvhSubtree own, uint slot) {
    lbvh_store_box(node, side, own.box);
    uint leaf = own.first << BVH2_COUNT_BITS | (own.last - own.first + 1u);
    lbvh_nodes[4u * LBVH_NODE_QUARTERS * node + 12u + side] = int(own.height == 0u ? leaf : slot << BVH2_COUNT_BITS);
}

void lbvh_store_summary(uint node, uint side, LbvhSubtree own) {
    uint level = side == 0u ? own.left_level : own.right_level;
    lbvh_summaries[2u * node + side] =
        LbvhSummary(own.cost, own.height << LBVH_LEVEL_BITS | level, side == 0u ? own.first : own.last);
}

LbvhSubtree lbvh_load_child(uint node, uint side) {
    uint word = 4u * LBVH_NODE_QUARTERS * node + 6u * side;
    LbvhSubtree child;
    child.box = LbvhBox(ivec3(lbvh_nodes[word], lbvh_nodes[word + 1u], lbvh_nodes[word + 2u]),
                        ivec3(lbvh_nodes[word + 3u], lbvh_nodes[word + 4u], lbvh_nodes[word + 5u]));
    LbvhSummary summary = lbvh_summaries[2u * node + side];
    child.cost = summary.cost;
    child.height = summary.height_level >> LBVH_LEVEL_BITS;
    child.left_level = child.right_level = summary.height_level & ((1u << LBVH_LEVEL_BITS) - 1u);
    child.first = side == 0u ? summary.end : node + 1u;
    child.last = side == 0u ? node : summary.end;
    return child;
}

bool lbvh_is_root(LbvhSubtree own) { return own.first == 0u && own.last + 1u == lbvh_push.count; }

// Both children of a node, which becomes a leaf where that is expected to cost rays no more.
LbvhSubtree lbvh_join(LbvhSubtree left, LbvhSubtree right, uint node) {
    LbvhSubtree both;
    both.box = lbvh_union(left.box, right.box);
    both.first = left.first;
    both.last = right.last;
    both.left_level = left.left_level;
    both.right_level = right.right_level;
    uint count = both.last - both.first + 1u;
    float area = lbvh_half_area(both.box);
    precise float split_cost = area + (left.cost + right.cost);
    precise float leaf_cost = area * float(count);
    bool is_root = lbvh_is_root(both);
    bool is_leaf = !is_root && count <= lbvh_push.leaf_size && leaf_cost <= split_cost;
    uint below = max(left.height, right.height);
    both.height = is_leaf ? 0u : below + 1u;
    both.cost = is_leaf ? leaf_cost : split_cost;
    lbvh_retained[node] = is_leaf ? 0u : 1u;
    // What a leaf holds does not stay.
    if (is_leaf && below > 0u) {
        for (uint inside = both.first; inside < both.last; ++inside) {
            lbvh_retained[inside] = 0u;
        }
    }
    if (is_root) {
        lbvh_state.root = node;
        lbvh_state.height = both.height;
        lbvh_state.cost = both.cost;
        lbvh_state.area = area;
    }
    return both;
}

#endif
