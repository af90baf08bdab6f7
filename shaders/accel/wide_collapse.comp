// Second stage of making a binary tree wide: the nodes of one level, with what their slots hold; twin of clerestory::accel::wide's collapse and slots.
//
// Where a node's children and triangles lie follows from what the first stage has counted of the subtrees before them, depth first. So the order of
// the list that hands nodes from level to level, which depends on the run, shows in no byte.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/wide_build.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform utextureBuffer wide_binary;
layout(set = 0, binding = 1, scalar) restrict readonly buffer WideSubtrees { WideSubtree wide_subtrees[]; };
layout(set = 0, binding = 2, scalar) restrict buffer WideStateBlock { WideState wide_state; };
layout(set = 0, binding = 3, scalar) restrict buffer WideLevels { uint wide_levels[]; };
// By wide nodes: its binary node, where its children begin, where its triangles begin, its parent word.
layout(set = 0, binding = 4, scalar) restrict buffer WideRoots { uvec4 wide_roots[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer WideTexels { uvec4 wide_texels[]; };

layout(push_constant, scalar) uniform WideCollapsePush { uint level; } wide_push;

#include "accel/wide_frame.glsl"

// A child of a binary node that waits for its place, as (node << 1 | side) << 3 | slots - 1 where it is to be split.
const uint WIDE_PENDING_BITS = 3u;
// Steps by which a node is split into its slots, at most, and nodes and leaves below a slot that is a leaf.
const uint WIDE_SPLIT_STEPS = 2u * WIDE_SLOTS;
const uint WIDE_LEAF_STEPS = 2u * WIDE_LEAF_SIZE;

uvec4 wide_words(uint node) { return texelFetch(wide_binary, int(BVH2_NODE_QUARTERS * node + 3u)); }

uint wide_word(uint child) { return wide_words(child >> 1)[child & 1u]; }

LbvhBox wide_child_box(uint child) {
    uint quarter = BVH2_NODE_QUARTERS * (child >> 1);
    vec4 q0 = uintBitsToFloat(texelFetch(wide_binary, int(quarter)));
    vec4 q1 = uintBitsToFloat(texelFetch(wide_binary, int(quarter + 1u)));
    vec4 q2 = uintBitsToFloat(texelFetch(wide_binary, int(quarter + 2u)));
    bool is_left = (child & 1u) == 0u;
    vec3 lower = is_left ? q0.xyz : vec3(q1.zw, q2.x);
    vec3 upper = is_left ? vec3(q0.w, q1.xy) : q2.yzw;
    return LbvhBox(ordered_integers(lower), ordered_integers(upper));
}

// Slots of the left child where a node is split into so many.
uint wide_left(uint choices, uint slots) {
    return 1u + (choices >> WIDE_LEFT_BITS * (slots - 2u) & ((1u << WIDE_LEFT_BITS) - 1u));
}

uint wide_pending(uint child, uint slots) { return child << WIDE_PENDING_BITS | (slots - 1u); }

// Twice a child's distance from a centre along the diagonal of a slot, of which the vector has the components.
float wide_distance(vec3 from_centre, uint slot) {
    precise float distance = ((slot & 1u) != 0u ? from_centre.x : -from_centre.x) + ((slot & 2u) != 0u ? from_centre.y : -from_centre.y)
                           + ((slot & 4u) != 0u ? from_centre.z : -from_centre.z);
    return distance;
}

// Copies a triangle of the binary tree.
void wide_copy(uint from, uint to) {
    for (uint i = 0u; i < WIDE_TRIANGLE_TEXELS; ++i) {
        wide_texels[to + i] = texelFetch(wide_binary, int(from + i));
    }
}

void main() {
    uint level = wide_push.level;
    uint at = gl_GlobalInvocationID.x + (level == 0u ? 0u : wide_state.ends[max(level, 1u) - 1u]);
    if (at >= wide_state.ends[level]) {
        return;
    }
    uint place = wide_levels[at];
    uvec4 root = wide_roots[place];

    // What the slots hold, from left to right, and which of it are nodes.
    uint held[WIDE_SLOTS];
    uint count = 0u;
    uint inner = 0u;
    uint pending[WIDE_SLOTS];
    uint top = 2u;
    uint left = wide_left(wide_subtrees[root.x].choices, WIDE_SLOTS);
    pending[0] = wide_pending(root.x << 1 | 1u, WIDE_SLOTS - left);
    pending[1] = wide_pending(root.x << 1, left);
    for (uint i = 0u; top > 0u && i < WIDE_SPLIT_STEPS; ++i) {
        --top;
        uint child = pending[top] >> WIDE_PENDING_BITS;
        uint slots = 1u + (pending[top] & ((1u << WIDE_PENDING_BITS) - 1u));
        uint word = wide_word(child);
        bool is_leaf = (word & BVH2_COUNT_MASK) != 0u;
        uint node = is_leaf ? 0u : word >> BVH2_COUNT_BITS;
        uint choices = wide_subtrees[node].choices;
        // As few slots as cost as little.
        uint less = is_leaf ? 0u : choices >> WIDE_LESS_SHIFT & ((1u << (slots - 1u)) - 1u);
        if (less == 0u) {
            held[count] = child;
            inner |= is_leaf || (choices >> WIDE_IS_LEAF_SHIFT & 1u) != 0u ? 0u : 1u << count;
            ++count;
        } else {
            uint fewest = uint(findMSB(less)) + 2u;
            uint to_left = wide_left(choices, fewest);
            pending[top] = wide_pending(node << 1 | 1u, fewest - to_left);
            pending[top + 1u] = wide_pending(node << 1, to_left);
            top += 2u;
        }
    }

    LbvhBox all = lbvh_union(wide_child_box(root.x << 1), wide_child_box(root.x << 1 | 1u));
    precise vec3 centre = 0.5 * ordered_floats(all.lower) + 0.5 * ordered_floats(all.upper);
    vec3 from_centre[WIDE_SLOTS];
    for (uint i = 0u; i < count; ++i) {
        LbvhBox box = wide_child_box(held[i]);
        precise vec3 doubled = (ordered_floats(box.lower) - centre) + (ordered_floats(box.upper) - centre);
        from_centre[i] = doubled;
    }
    // The largest distance that is left goes next, nodes before leaves.
    uint child_of[WIDE_SLOTS];
    uint occupied = 0u;
    uint waiting = (1u << count) - 1u;
    for (uint turn = 0u; turn < count; ++turn) {
        uint among = (waiting & inner) != 0u ? waiting & inner : waiting;
        float best = uintBitsToFloat(WIDE_EXPONENT_MASK | 0x80000000u);
        uint best_child = uint(findLSB(among));
        uint best_slot = uint(findLSB(~occupied));
        for (uint i = 0u; i < WIDE_SLOTS * WIDE_SLOTS; ++i) {
            uint child = i >> WIDE_SLOT_BITS;
            uint slot = i & WIDE_SLOT_MASK;
            bool is_free = (among >> child & 1u) != 0u && (occupied >> slot & 1u) == 0u;
            float distance = wide_distance(from_centre[child], slot);
            bool is_better = is_free && distance > best;
            best = is_better ? distance : best;
            best_child = is_better ? child : best_child;
            best_slot = is_better ? slot : best_slot;
        }
        child_of[best_slot] = best_child;
        occupied |= 1u << best_slot;
        waiting &= ~(1u << best_child);
    }

    uint first_triangle = WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * wide_state.nodes;
    uint binary_triangles = wide_words(0u).w;
    LbvhBox boxes[WIDE_SLOTS];
    uint slots = 0u;
    uint triangle = root.z;
    for (uint slot = 0u; slot < WIDE_SLOTS; ++slot) {
        if ((occupied >> slot & 1u) != 0u) {
            uint child = held[child_of[slot]];
            boxes[slot] = wide_child_box(child);
            bool is_inner = (inner >> child_of[slot] & 1u) != 0u;
            slots |= is_inner ? 1u << (WIDE_INNER_SHIFT + slot) : 0u;
            // Leaves of the binary tree from left to right.
            uint words[WIDE_LEAF_STEPS];
            words[0] = wide_word(child);
            uint left_words = is_inner ? 0u : 1u;
            uint own = 0u;
            for (uint i = 0u; left_words > 0u && i < WIDE_LEAF_STEPS; ++i) {
                --left_words;
                uint word = words[left_words];
                uint in_leaf = word & BVH2_COUNT_MASK;
                for (uint j = 0u; j < in_leaf; ++j) {
                    uint from = binary_triangles + BVH2_TRIANGLE_QUARTERS * ((word >> BVH2_COUNT_BITS) + j);
                    wide_copy(from, first_triangle + WIDE_TRIANGLE_TEXELS * triangle);
                    ++triangle;
                    ++own;
                }
                if (in_leaf == 0u) {
                    uvec2 below = wide_words(word >> BVH2_COUNT_BITS).xy;
                    words[left_words] = below.y;
                    words[left_words + 1u] = below.x;
                    left_words += 2u;
                }
            }
            slots |= ((1u << own) - 1u) << WIDE_LEAF_SIZE * slot;
        }
    }
    uint texel = WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * place;
    wide_set_boxes(texel, all, occupied, boxes);
    wide_texels[texel + 1u] = uvec4(root.yz, slots, root.w);

    uint nodes = uint(bitCount(inner));
    uint listed = nodes > 0u ? atomicAdd(wide_state.listed, nodes) : 0u;
    uint child_place = root.y;
    uint below = root.y + nodes;
    for (uint slot = 0u; slot < WIDE_SLOTS; ++slot) {
        if ((slots >> (WIDE_INNER_SHIFT + slot) & 1u) != 0u) {
            uint node = wide_word(held[child_of[slot]]) >> BVH2_COUNT_BITS;
            wide_roots[child_place] = uvec4(node, below, triangle, place << WIDE_SLOT_BITS | slot);
            wide_levels[listed] = child_place;
            below += wide_subtrees[node].nodes[0] - 1u;
            triangle += wide_subtrees[node].triangles;
            ++listed;
            ++child_place;
        }
    }
    if (place == 0u) {
        wide_texels[0] = uvec4(floatBitsToUint(ordered_floats(all.lower)), first_triangle);
        wide_texels[1] = uvec4(floatBitsToUint(ordered_floats(all.upper)), 0u);
    }
}
