#version 460
// One invocation: where queries begin, and the first range that is split.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#define MAP_CODES
#define MAP_BOXES
#include "accel/map_tree.glsl"

layout(local_size_x = 1) in;

layout(set = 0, binding = 2, scalar) restrict buffer MapStateBlock { MapTreeState map_state; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer MapNodes { uvec4 map_nodes[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer MapRoot { CompactRoot map_root; };

layout(push_constant, scalar) uniform MapBeginPush {
    uint count;  // places
    uint all;    // the block of all of them
} map_push;

void main() {
    uint last = map_push.count - 1u;
    bool splits = map_splits(0u, last, map_code(0u), map_code(last), map_state.leaf_size);
    LbvhBox box = map_block(map_push.all);
    map_root = CompactRoot(ordered_floats(box.lower), splits ? 0u : COMPACT_LEAF_BIT, ordered_floats(box.upper), 0u);
    if (splits) {
        map_nodes[0] = uvec4(0u, last, 0u, 0u);
        map_state.levels[0].groups[0] = 1u;
        map_state.levels[0].count = 1u;
        map_state.node_groups[0] = 1u;
    }
}
