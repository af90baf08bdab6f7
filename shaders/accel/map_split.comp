#version 460
// Splits the ranges of a level's inner nodes, and lists those of the next. In which order these are listed does not show in the tree.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define MAP_CODES
#include "accel/map_tree.glsl"

layout(local_size_x = MAP_GROUP_SIZE) in;

layout(set = 0, binding = 1, scalar) restrict buffer MapStateBlock { MapTreeState map_state; };
// First and last place, nodes that have the range in their left child, split.
layout(set = 0, binding = 2, scalar) restrict buffer MapNodes { uvec4 map_nodes[]; };
// 1 for places at which a node is split; the host fills it with zero.
layout(set = 0, binding = 3, scalar) restrict writeonly buffer MapRetained { uint map_retained[]; };

layout(push_constant, scalar) uniform MapSplitPush { uint level; } map_push;

void map_list(uint first, uint last, uint lefts, uint begin) {
    uint place = atomicAdd(map_state.levels[map_push.level + 1u].count, 1u);
    if (place % MAP_GROUP_SIZE == 0u) {
        atomicAdd(map_state.levels[map_push.level + 1u].groups[0], 1u);
    }
    uint node = begin + place;
    if (node % MAP_GROUP_SIZE == 0u) {
        atomicAdd(map_state.node_groups[0], 1u);
    }
    map_nodes[node] = uvec4(first, last, lefts, 0u);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    uint begin = map_state.levels[map_push.level].begin;
    uint count = map_state.levels[map_push.level].count;
    if (index == 0u) {
        map_state.levels[map_push.level + 1u].begin = begin + count;
        map_state.nodes = begin + count;
    }
    if (index >= count) {
        return;
    }
    uvec4 node = map_nodes[begin + index];
    uint first_code = map_code(node.x);
    uint last_code = map_code(node.y);
    // The last place whose code has a 0 in the highest bit that differs, and the first with a 1.
    uint bit = uint(findMSB(first_code ^ last_code));
    uvec2 ends = node.xy;
    for (uint i = 0u; i < 32u && ends.y - ends.x > 1u; ++i) {
        uint middle = ends.x + ((ends.y - ends.x) >> 1);
        bool is_left = (map_code(middle) >> bit & 1u) == 0u;
        ends = is_left ? uvec2(middle, ends.y) : uvec2(ends.x, middle);
    }
    map_nodes[begin + index].w = ends.x;
    map_retained[ends.x] = 1u;
    uint leaf_size = map_state.leaf_size;
    if (map_splits(node.x, ends.x, first_code, map_code(ends.x), leaf_size)) {
        map_list(node.x, ends.x, node.z + 1u, begin + count);
    }
    if (map_splits(ends.y, node.y, map_code(ends.y), last_code, leaf_size)) {
        map_list(ends.y, node.y, node.z, begin + count);
    }
}
