// Last stage of the linear hierarchy: nodes and triangles in the layout that rays traverse (accel/index_bindings.glsl), the root first and
// the others in the order of their splits, without those inside leaves.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform utextureBuffer lbvh_nodes;
layout(set = 0, binding = 1) uniform utextureBuffer lbvh_retained;
// Nodes that stay before each.
layout(set = 0, binding = 2) uniform utextureBuffer lbvh_ranks;
layout(set = 0, binding = 3) uniform utextureBuffer lbvh_order;
layout(set = 0, binding = 4, scalar) restrict readonly buffer LbvhCorners { vec3 lbvh_corners[]; };
// Index of each triangle as hits name it.
layout(set = 0, binding = 5, scalar) restrict readonly buffer LbvhIndices { uint lbvh_indices[]; };
layout(set = 0, binding = 6, scalar) restrict writeonly buffer LbvhWords { uint lbvh_words[]; };
layout(set = 0, binding = 7, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(push_constant, scalar) uniform LbvhEmitPush { uint count; } lbvh_push;

uint lbvh_rank(uint split) { return texelFetch(lbvh_ranks, int(split)).x; }

uint lbvh_target(uint split, uint root) { return split == root ? 0u : lbvh_rank(split) + (split < root ? 1u : 0u); }

void lbvh_store(uint at, uvec3 v) {
    lbvh_words[at] = v.x;
    lbvh_words[at + 1u] = v.y;
    lbvh_words[at + 2u] = v.z;
}

// The child's word, and in an inner child the parent's.
void lbvh_store_child(uint to, uint side, uint word, uint root) {
    bool is_leaf = (word & BVH2_COUNT_MASK) != 0u;
    uint child = is_leaf ? 0u : lbvh_target(word >> BVH2_COUNT_BITS, root);
    lbvh_words[BVH2_NODE_WORDS * to + 12u + side] = is_leaf ? word : child << BVH2_COUNT_BITS;
    if (!is_leaf) {
        lbvh_words[BVH2_NODE_WORDS * child + 14u] = to << 1 | side;
    }
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    uint count = lbvh_push.count;
    if (place >= count) {
        return;
    }
    uint root = lbvh_state.root;
    uint nodes = lbvh_rank(count - 2u) + texelFetch(lbvh_retained, int(count - 2u)).x;
    uint primitive = texelFetch(lbvh_order, int(place >> 2))[place & 3u];
    uint triangle = BVH2_NODE_WORDS * nodes + BVH2_TRIANGLE_WORDS * place;
    for (uint corner = 0u; corner < 3u; ++corner) {
        lbvh_store(triangle + 3u * corner, floatBitsToUint(lbvh_corners[3u * primitive + corner]));
    }
    lbvh_store(triangle + 9u, uvec3(lbvh_indices[primitive], 0u, 0u));
    if (place + 1u < count && texelFetch(lbvh_retained, int(place)).x != 0u) {
        uint to = lbvh_target(place, root);
        uint at = BVH2_NODE_WORDS * to;
        ivec4 a = ivec4(texelFetch(lbvh_nodes, int(LBVH_NODE_QUARTERS * place)));
        ivec4 b = ivec4(texelFetch(lbvh_nodes, int(LBVH_NODE_QUARTERS * place + 1u)));
        ivec4 c = ivec4(texelFetch(lbvh_nodes, int(LBVH_NODE_QUARTERS * place + 2u)));
        uvec2 words = texelFetch(lbvh_nodes, int(LBVH_NODE_QUARTERS * place + 3u)).xy;
        lbvh_store(at, floatBitsToUint(ordered_floats(a.xyz)));
        lbvh_store(at + 3u, floatBitsToUint(ordered_floats(ivec3(a.w, b.xy))));
        lbvh_store(at + 6u, floatBitsToUint(ordered_floats(ivec3(b.zw, c.x))));
        lbvh_store(at + 9u, floatBitsToUint(ordered_floats(c.yzw)));
        lbvh_store_child(to, 0u, words.x, root);
        lbvh_store_child(to, 1u, words.y, root);
        bool is_root = place == root;
        if (is_root) {
            lbvh_words[at + 14u] = 0u;
        }
        lbvh_words[at + 15u] = is_root ? BVH2_NODE_QUARTERS * nodes : 0u;
    }
    if (place == 0u) {
        lbvh_state.nodes = nodes;
    }
}
