// What the stages of the wide hierarchy's build share: the binary tree that is collapsed, and what is known of its subtrees.
#ifndef CLERESTORY_ACCEL_WIDE_BUILD_GLSL
#define CLERESTORY_ACCEL_WIDE_BUILD_GLSL

#include "accel/lbvh.glsl"
#include "accel/wide_layout.glsl"

// Numbers of slots that a subtree may take.
const uint WIDE_BUDGETS = WIDE_SLOTS - 1u;
// Most levels of nodes.
const uint WIDE_LEVELS = 32u;
// Bits of the word of choices: by budgets of two and more, how many slots the left child gets, less one; from the second on, a bit for each from two
// to seven that costs less than one slot fewer; and whether the subtree is a leaf where it has one slot.
const uint WIDE_LEFT_BITS = 3u;
const uint WIDE_LESS_SHIFT = 21u;
const uint WIDE_IS_LEAF_SHIFT = 27u;

// What is known of the subtree of a binary node.
struct WideSubtree {
    // Least cost by budget, from one slot on.
    float costs[WIDE_BUDGETS];
    // Wide nodes that it becomes, likewise; those below the subtree's own where it is one.
    uint nodes[WIDE_BUDGETS];
    uint triangles;
    uint choices;
};

// What the stages tell each other and the host. The host writes that one node is listed.
struct WideState {
    // Wide nodes.
    uint nodes;
    // Those that are listed by now.
    uint listed;
    // Where levels end in the list.
    uint ends[WIDE_LEVELS];
};

#endif
