// Fourth stage of the linear hierarchy: the nodes below runs of neighbouring places, with their boxes, costs and leaves; twin of
// clerestory::accel::lbvh::radix_tree.
//
// An invocation walks along its run and joins what lies lower than the level after it: of two neighbouring ranges the one whose codes
// differ in the lower bit is joined first (C. Apetrei, "Fast and Simple Agglomerative LBVH Construction", 2014). What it leaves on the way
// up finds its sibling in memory, so there is no stack; nodes that reach into another run are left to lbvh_climb. Long runs make most of
// the tree without atomic operations; runs of one place leave everything to the climb.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh_subtree.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(constant_id = 0) const uint LBVH_CODE_WORDS = 1u;
// Places of a run.
layout(constant_id = 2) const uint LBVH_RUN = 1u;

layout(set = 0, binding = 5) uniform utextureBuffer lbvh_boxes;
// Sorted; four words per texel.
layout(set = 0, binding = 6) uniform utextureBuffer lbvh_codes;
layout(set = 0, binding = 7) uniform utextureBuffer lbvh_order;

uvec2 lbvh_code(uint place) {
    uvec4 four = texelFetch(lbvh_codes, int(place * LBVH_CODE_WORDS >> 2));
    if (LBVH_CODE_WORDS == 2u) {
        return (place & 1u) == 0u ? four.xy : four.zw;
    }
    return uvec2(four[place & 3u], 0u);
}

// How far up two neighbouring codes differ: bits without the skipped ones, and below them those of the places.
uint lbvh_level(uint place, uvec2 code, uvec2 next) {
    uint skipped = lbvh_push.skipped;
    uvec2 difference = code ^ next;
    difference.x &= skipped >= 32u ? 0u : 0xFFFFFFFFu << skipped;
    difference.y &= skipped >= 64u ? 0u : (skipped > 32u ? 0xFFFFFFFFu << (skipped - 32u) : 0xFFFFFFFFu);
    uint code_level = difference.y != 0u ? 64u + uint(findMSB(difference.y)) : 32u + uint(findMSB(difference.x));
    return (difference.x | difference.y) != 0u ? code_level : uint(findMSB(place ^ (place + 1u)));
}

// The box of the primitive at a place, as a leaf between two levels.
LbvhSubtree lbvh_leaf(uint place, uint left_level, uint right_level) {
    uint primitive = texelFetch(lbvh_order, int(place >> 2))[place & 3u];
    ivec4 low = ivec4(texelFetch(lbvh_boxes, int(LBVH_BOX_QUARTERS * primitive)));
    ivec2 high = ivec2(texelFetch(lbvh_boxes, int(LBVH_BOX_QUARTERS * primitive + 1u)).xy);
    LbvhBox box = LbvhBox(low.xyz, ivec3(low.w, high));
    return LbvhSubtree(box, lbvh_half_area(box), 0u, place, place, left_level, right_level);
}

void lbvh_wait(uint run, uint waiting, uint node) { lbvh_pending[lbvh_push.runs * (1u + waiting) + run] = node; }

void main() {
    uint run = gl_GlobalInvocationID.x;
    uint begin = run * LBVH_RUN;
    uint count = lbvh_push.count;
    if (begin >= count) {
        return;
    }
    uint end = min(begin + LBVH_RUN, count);
    // What begins before this has a parent that reaches into another run.
    uint low = begin;
    uint waiting = 0u;
    uvec2 code = lbvh_code(begin);
    uvec2 next = lbvh_code(min(begin + 1u, count - 1u));
    uint level = begin == 0u ? LBVH_NO_LEVEL : lbvh_level(begin - 1u, lbvh_code(begin - 1u), code);
    LbvhSubtree own = lbvh_leaf(begin, level, begin + 1u == count ? LBVH_NO_LEVEL : lbvh_level(begin, code, next));
    uint slot = 0u;
    bool going = true;
    for (uint i = 0u; going && i < 2u * LBVH_RUN; ++i) {
        bool is_left = own.right_level < own.left_level;
        uint node = is_left ? own.last : own.first - 1u;
        bool joins = !is_left && own.first > low;
        if (lbvh_is_root(own)) {
            low = count;
            going = false;
        } else {
            lbvh_store_child(node, is_left ? 0u : 1u, own, slot);
            if (joins) {
                own = lbvh_join(lbvh_load_child(node, 0u), own, node);
                slot = node;
            } else {
                lbvh_store_summary(node, is_left ? 0u : 1u, own);
                uint place = own.last + 1u;
                if (!is_left) {
                    lbvh_wait(run, waiting, node);
                    ++waiting;
                    low = place;
                }
                going = place < end;
                if (going) {
                    code = next;
                    next = lbvh_code(min(place + 1u, count - 1u));
                    level = own.right_level;
                    own = lbvh_leaf(place, level, place + 1u == count ? LBVH_NO_LEVEL : lbvh_level(place, code, next));
                }
            }
        }
    }
    // Left children whose siblings are not in this run, from the last to the first.
    uint at = end;
    for (uint i = 0u; at > low && i < LBVH_RUN; ++i) {
        lbvh_wait(run, waiting, at - 1u);
        ++waiting;
        at = lbvh_summaries[2u * (at - 1u)].end;
    }
    lbvh_pending[run] = waiting;
}
