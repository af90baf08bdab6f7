// First stage of making a binary tree wide: least costs of its subtrees by the slots that they may take, from the leaves up, and the choices
// that lead there; twin of clerestory::accel::wide's collapse (Ylitie, Karras and Laine, HPG 2017, §3.1).
//
// One invocation per child of a node: those of leaves climb, and the second to arrive at a node goes on. Nobody waits. The host fills
// `wide_arrival_counters` with zero. Wide nodes and triangles are counted on the way, so that no later stage has to ask where a node lies.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh_fence.glsl"
#include "accel/wide_build.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform utextureBuffer wide_binary;
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhStateBlock { LbvhState lbvh_state; };
layout(set = 0, binding = 2, scalar) restrict coherent buffer WideSubtrees { WideSubtree wide_subtrees[]; };
layout(set = 0, binding = 3, scalar) restrict coherent buffer WideArrivalCounters { uint wide_arrival_counters[]; };
layout(set = 0, binding = 4, scalar) restrict buffer WideStateBlock { WideState wide_state; };

layout(push_constant, scalar) uniform WideCostsPush { float triangle_cost; } wide_push;

float wide_leaf_cost(float area, uint count) {
    precise float cost = area * float(count) * wide_push.triangle_cost;
    return count <= WIDE_LEAF_SIZE ? cost : uintBitsToFloat(WIDE_EXPONENT_MASK);
}

float wide_half_area(vec3 lower, vec3 upper) {
    precise vec3 e = upper - lower;
    precise float area = e.x * e.y + e.y * e.z + e.z * e.x;
    return area;
}

// A child: that of an inner node from what was found of it.
WideSubtree wide_subtree(uint word, vec3 lower, vec3 upper) {
    uint count = word & BVH2_COUNT_MASK;
    if (count == 0u) {
        return wide_subtrees[word >> BVH2_COUNT_BITS];
    }
    float cost = wide_leaf_cost(wide_half_area(lower, upper), count);
    WideSubtree leaf;
    for (uint budget = 0u; budget < WIDE_BUDGETS; ++budget) {
        leaf.costs[budget] = cost;
        leaf.nodes[budget] = 0u;
    }
    leaf.triangles = count;
    leaf.choices = 0u;
    return leaf;
}

// Joins the children of a node. Returns the wide nodes below it where it is one.
uint wide_join(uint node) {
    vec4 q0 = uintBitsToFloat(texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node)));
    vec4 q1 = uintBitsToFloat(texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 1u)));
    vec4 q2 = uintBitsToFloat(texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 2u)));
    uvec2 words = texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 3u)).xy;
    vec3 lower[2] = {q0.xyz, vec3(q1.zw, q2.x)};
    vec3 upper[2] = {vec3(q0.w, q1.xy), q2.yzw};
    WideSubtree left = wide_subtree(words.x, lower[0], upper[0]);
    WideSubtree right = wide_subtree(words.y, lower[1], upper[1]);
    float area = wide_half_area(min(lower[0], lower[1]), max(upper[0], upper[1]));
    uint triangles = left.triangles + right.triangles;
    float leaf = wide_leaf_cost(area, triangles);
    // Of two slots on; those of all slots at the end, for the node itself.
    float least[WIDE_BUDGETS];
    uint nodes[WIDE_BUDGETS];
    uint choices = 0u;
    for (uint slots = 2u; slots <= WIDE_SLOTS; ++slots) {
        precise float best = left.costs[0] + right.costs[slots - 2u];
        uint at = 1u;
        for (uint i = 2u; i < slots; ++i) {
            precise float cost = left.costs[i - 1u] + right.costs[slots - i - 1u];
            at = cost < best ? i : at;
            best = cost < best ? cost : best;
        }
        least[slots - 2u] = best;
        nodes[slots - 2u] = left.nodes[at - 1u] + right.nodes[slots - at - 1u];
        choices |= (at - 1u) << WIDE_LEFT_BITS * (slots - 2u);
    }
    uint below = nodes[WIDE_BUDGETS - 1u];
    WideSubtree own;
    precise float whole = area + least[WIDE_BUDGETS - 1u];
    own.costs[0] = min(whole, leaf);
    bool is_leaf = leaf <= own.costs[0];
    own.nodes[0] = is_leaf ? 0u : 1u + below;
    choices |= is_leaf ? 1u << WIDE_IS_LEAF_SHIFT : 0u;
    for (uint slots = 2u; slots < WIDE_SLOTS; ++slots) {
        float fewer = own.costs[slots - 2u];
        bool costs_less = least[slots - 2u] < fewer;
        own.costs[slots - 1u] = costs_less ? least[slots - 2u] : fewer;
        own.nodes[slots - 1u] = costs_less ? nodes[slots - 2u] : own.nodes[slots - 2u];
        choices |= costs_less ? 1u << (WIDE_LESS_SHIFT + slots - 2u) : 0u;
    }
    own.triangles = triangles;
    own.choices = choices;
    wide_subtrees[node] = own;
    return below;
}

void main() {
    uint node = gl_GlobalInvocationID.x >> 1;
    uint side = gl_GlobalInvocationID.x & 1u;
    if (node >= lbvh_state.nodes) {
        return;
    }
    uint word = texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 3u))[side];
    bool climbing = (word & BVH2_COUNT_MASK) != 0u;
    for (uint level = 0u; climbing && level < LBVH_MAX_ASCENT; ++level) {
        lbvh_fence();
        climbing = atomicAdd(wide_arrival_counters[node], 1u) != 0u;
        lbvh_fence();
        if (climbing) {
            uint below = wide_join(node);
            if (node == 0u) {
                wide_state.nodes = 1u + below;
            }
            climbing = node != 0u;
            node = texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 3u)).z >> 1;
        }
    }
}
