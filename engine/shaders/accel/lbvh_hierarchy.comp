// Fourth stage of the linear hierarchy: the tree of the sorted codes with its boxes, costs and leaves in one ascent; twin of
// clerestory::accel::lbvh::radix.
//
// Each invocation climbs from a leaf. At a node the first to arrive leaves what it brings and ends, the second goes on: nobody waits, so
// nothing is asked of the scheduler, and which of both it is does not show in the tree (Karras 2012; the choice of the parent by the
// neighbouring differences is Apetrei's, 2014). A node is named by the last place of its left child. The host fills `lbvh_arrivals` with
// zero.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/lbvh_fence.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(constant_id = 0) const uint LBVH_CODE_WORDS = 1u;

// What a child tells its parent besides its box.
struct LbvhMail {
    float cost;
    uint height;
    // First place of a left child, last of a right one.
    uint end;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhBoxes { LbvhBox lbvh_boxes[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhCodes { uint lbvh_codes[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer LbvhOrder { uint lbvh_order[]; };
layout(set = 0, binding = 3, scalar) restrict coherent buffer LbvhNodes { int lbvh_nodes[]; };
layout(set = 0, binding = 4, scalar) restrict coherent buffer LbvhMails { LbvhMail lbvh_mails[]; };
layout(set = 0, binding = 5, scalar) restrict coherent buffer LbvhArrivals { uint lbvh_arrivals[]; };
// 1 for nodes that stay, 0 for those inside of leaves.
layout(set = 0, binding = 6, scalar) restrict coherent buffer LbvhKept { uint lbvh_kept[]; };
layout(set = 0, binding = 7, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(push_constant, scalar) uniform LbvhHierarchyPush {
    uint count;
    // Lowest bits of the codes that do not count.
    uint skipped;
    uint leaf_size;
} lbvh_push;

// How a code differs from the next, the highest word last: codes without the skipped bits, then places.
uvec3 lbvh_difference(uint place) {
    uvec2 difference = uvec2(lbvh_codes[LBVH_CODE_WORDS * place] ^ lbvh_codes[LBVH_CODE_WORDS * (place + 1u)], 0u);
    if (LBVH_CODE_WORDS == 2u) {
        difference.y = lbvh_codes[2u * place + 1u] ^ lbvh_codes[2u * place + 3u];
    }
    uint skipped = lbvh_push.skipped;
    if (skipped >= 32u) {
        difference = uvec2(difference.y & (skipped >= 64u ? 0u : 0xFFFFFFFFu << (skipped - 32u)), 0u).yx;
    } else {
        difference.x &= 0xFFFFFFFFu << skipped;
    }
    return uvec3(place ^ (place + 1u), difference);
}

bool lbvh_less(uvec3 a, uvec3 b) {
    return a.z != b.z ? a.z < b.z : (a.y != b.y ? a.y < b.y : a.x < b.x);
}

void lbvh_store_box(uint word, LbvhBox box) {
    lbvh_nodes[word] = box.lower.x;
    lbvh_nodes[word + 1u] = box.lower.y;
    lbvh_nodes[word + 2u] = box.lower.z;
    lbvh_nodes[word + 3u] = box.upper.x;
    lbvh_nodes[word + 4u] = box.upper.y;
    lbvh_nodes[word + 5u] = box.upper.z;
}

LbvhBox lbvh_load_box(uint word) {
    return LbvhBox(ivec3(lbvh_nodes[word], lbvh_nodes[word + 1u], lbvh_nodes[word + 2u]),
                   ivec3(lbvh_nodes[word + 3u], lbvh_nodes[word + 4u], lbvh_nodes[word + 5u]));
}

void lbvh_drop(uint node, uint last) {
    if (node < last) {
        lbvh_kept[node] = 0u;
    }
}

void main() {
    uint first = gl_GlobalInvocationID.x;
    if (first >= lbvh_push.count) {
        return;
    }
    uint end = lbvh_push.count - 1u;
    uint last = first;
    LbvhBox box = lbvh_boxes[lbvh_order[first]];
    float cost = lbvh_half_area(box);
    uint height = 0u;
    uint word = first << LBVH_COUNT_BITS | 1u;
    bool climbing = true;
    for (uint i = 0u; climbing && i < LBVH_MAX_ASCENT; ++i) {
        bool is_left = first == 0u || (last != end && lbvh_less(lbvh_difference(last), lbvh_difference(first - 1u)));
        uint parent = is_left ? last : first - 1u;
        uint side = is_left ? 0u : 1u;
        uint node = LBVH_NODE_WORDS * parent;
        lbvh_store_box(node + 6u * side, box);
        lbvh_nodes[node + 12u + side] = int(word);
        lbvh_mails[2u * parent + side] = LbvhMail(cost, height, is_left ? first : last);
        if ((word & LBVH_COUNT_MASK) == 0u) {
            lbvh_nodes[LBVH_NODE_WORDS * (word >> LBVH_COUNT_BITS) + 14u] = int(parent << 1 | side);
        }
        lbvh_fence();
        climbing = atomicAdd(lbvh_arrivals[parent], 1u) != 0u;
        lbvh_fence();
        // The first to arrive ends here.
        if (climbing) {
            box = lbvh_union(box, lbvh_load_box(node + 6u * (1u - side)));
            LbvhMail sibling = lbvh_mails[2u * parent + 1u - side];
            first = is_left ? first : sibling.end;
            last = is_left ? sibling.end : last;
            float area = lbvh_half_area(box);
            uint count = last - first + 1u;
            precise float split_cost = area + (cost + sibling.cost);
            precise float leaf_cost = area * float(count);
            bool is_root = count == lbvh_push.count;
            bool is_leaf = !is_root && count <= lbvh_push.leaf_size && leaf_cost <= split_cost;
            height = is_leaf ? 0u : max(height, sibling.height) + 1u;
            cost = is_leaf ? leaf_cost : split_cost;
            word = is_leaf ? first << LBVH_COUNT_BITS | count : parent << LBVH_COUNT_BITS;
            lbvh_kept[parent] = is_leaf ? 0u : 1u;
            // What a leaf holds stays not: one node less than it has primitives, which are eight at most.
            if (is_leaf) {
                lbvh_drop(first, last);
                lbvh_drop(first + 1u, last);
                lbvh_drop(first + 2u, last);
                lbvh_drop(first + 3u, last);
                lbvh_drop(first + 4u, last);
                lbvh_drop(first + 5u, last);
                lbvh_drop(first + 6u, last);
            }
            if (is_root) {
                lbvh_nodes[node + 14u] = 0;
                lbvh_state.root = parent;
                lbvh_state.height = height;
            }
            climbing = !is_root;
        }
    }
}
