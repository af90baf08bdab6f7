#version 460
// Last stage of the compact hierarchy: sibling pairs with the planes that are not their parent's, from the root down, left first; twin of
// clerestory::accel::photon_map::compact_bvh::CompactBvh::encode, to the bit.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define MAP_CODES
#define MAP_BOXES
#include "accel/map_tree.glsl"

layout(local_size_x = MAP_GROUP_SIZE) in;

// Nodes that are split before each place.
layout(set = 0, binding = 2) uniform utextureBuffer map_ranks;
layout(set = 0, binding = 3, scalar) restrict readonly buffer MapStateBlock { MapTreeState map_state; };
layout(set = 0, binding = 4, scalar) restrict readonly buffer MapNodes { uvec4 map_nodes[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer MapPairs { uvec4 map_pairs[]; };

layout(push_constant, scalar) uniform MapPairsPush { uint count; } map_push;

uint map_rank(uint place) { return texelFetch(map_ranks, int(place)).x; }

// A pair's half: the planes that differ from the parent's or, where both children have them, the left child's; their owners above the reference.
uvec4 map_half(ivec3 parent, ivec3 left, ivec3 right, uint reference) {
    bvec3 is_left = equal(parent, right);
    ivec3 planes = ivec3(is_left.x ? left.x : right.x, is_left.y ? left.y : right.y, is_left.z ? left.z : right.z);
    return uvec4(floatBitsToUint(ordered_floats(planes)), reference | compact_bits(is_left) << COMPACT_MASK_SHIFT);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= map_state.nodes) {
        return;
    }
    uvec4 node = map_nodes[index];
    uint split = node.w;
    uint leaf_size = map_state.leaf_size;
    uint pair = map_rank(node.x) + node.z;
    bool left_splits = map_splits(node.x, split, map_code(node.x), map_code(split), leaf_size);
    bool right_splits = map_splits(split + 1u, node.y, map_code(split + 1u), map_code(node.y), leaf_size);
    uint left_reference = left_splits ? pair + 1u : node.x | COMPACT_LEAF_BIT;
    uint right_reference = right_splits ? map_rank(split + 1u) + node.z : (split + 1u) | COMPACT_LEAF_BIT;
    LbvhBox left = map_range(node.x, split, map_push.count);
    LbvhBox right = map_range(split + 1u, node.y, map_push.count);
    LbvhBox both = lbvh_union(left, right);
    map_pairs[2u * pair] = map_half(both.lower, left.lower, right.lower, left_reference);
    map_pairs[2u * pair + 1u] = map_half(both.upper, left.upper, right.upper, right_reference);
}
