// Last stage of the linear hierarchy: nodes and triangles in the layout that rays traverse (accel/bvh2_bindings.glsl), the root first and
// the others in the order of their splits, without those inside of leaves.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

const uint LBVH_NODE_QUARTERS = 4u;
const uint LBVH_TRIANGLE_QUARTERS = 3u;

layout(set = 0, binding = 0, scalar) restrict readonly buffer LbvhNodes { int lbvh_nodes[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhKept { uint lbvh_kept[]; };
// Nodes that stay before each.
layout(set = 0, binding = 2, scalar) restrict readonly buffer LbvhRanks { uint lbvh_ranks[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer LbvhOrder { uint lbvh_order[]; };
layout(set = 0, binding = 4, scalar) restrict readonly buffer LbvhCorners { vec3 lbvh_corners[]; };
// Index of each triangle as hits name it.
layout(set = 0, binding = 5, scalar) restrict readonly buffer LbvhIndices { uint lbvh_indices[]; };
layout(set = 0, binding = 6, scalar) restrict writeonly buffer LbvhQuarters { uvec4 lbvh_quarters[]; };
layout(set = 0, binding = 7, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(push_constant, scalar) uniform LbvhEmitPush { uint count; } lbvh_push;

uint lbvh_target(uint split, uint root) {
    return split == root ? 0u : lbvh_ranks[split] + (split < root ? 1u : 0u);
}

uint lbvh_child(uint word, uint root) {
    return (word & LBVH_COUNT_MASK) != 0u ? word : lbvh_target(word >> LBVH_COUNT_BITS, root) << LBVH_COUNT_BITS;
}

uvec3 lbvh_corner(uint node, uint word) {
    uint at = LBVH_NODE_WORDS * node + word;
    return floatBitsToUint(ordered_floats(ivec3(lbvh_nodes[at], lbvh_nodes[at + 1u], lbvh_nodes[at + 2u])));
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    uint count = lbvh_push.count;
    if (place >= count) {
        return;
    }
    uint root = lbvh_state.root;
    uint nodes = lbvh_ranks[count - 2u] + lbvh_kept[count - 2u];
    uint primitive = lbvh_order[place];
    uvec3 a = floatBitsToUint(lbvh_corners[3u * primitive]);
    uvec3 b = floatBitsToUint(lbvh_corners[3u * primitive + 1u]);
    uvec3 c = floatBitsToUint(lbvh_corners[3u * primitive + 2u]);
    uint triangle = LBVH_NODE_QUARTERS * nodes + LBVH_TRIANGLE_QUARTERS * place;
    lbvh_quarters[triangle] = uvec4(a, b.x);
    lbvh_quarters[triangle + 1u] = uvec4(b.yz, c.xy);
    lbvh_quarters[triangle + 2u] = uvec4(c.z, lbvh_indices[primitive], 0u, 0u);
    if (place + 1u < count && lbvh_kept[place] != 0u) {
        uint at = LBVH_NODE_QUARTERS * lbvh_target(place, root);
        uvec3 lower0 = lbvh_corner(place, 0u);
        uvec3 upper0 = lbvh_corner(place, 3u);
        uvec3 lower1 = lbvh_corner(place, 6u);
        uvec3 upper1 = lbvh_corner(place, 9u);
        uint words = LBVH_NODE_WORDS * place + 12u;
        uint parent = uint(lbvh_nodes[words + 2u]);
        bool is_root = place == root;
        lbvh_quarters[at] = uvec4(lower0, upper0.x);
        lbvh_quarters[at + 1u] = uvec4(upper0.yz, lower1.xy);
        lbvh_quarters[at + 2u] = uvec4(lower1.z, upper1);
        lbvh_quarters[at + 3u] = uvec4(lbvh_child(uint(lbvh_nodes[words]), root), lbvh_child(uint(lbvh_nodes[words + 1u]), root),
                                       is_root ? 0u : lbvh_target(parent >> 1, root) << 1 | (parent & 1u),
                                       is_root ? LBVH_NODE_QUARTERS * nodes : 0u);
    }
    if (place == 0u) {
        lbvh_state.nodes = nodes;
    }
}
