#version 460
// Boxes of blocks of four places, and of blocks of blocks, a level per dispatch. The first of them puts the places' own boxes into their order.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/map_tree.glsl"

layout(local_size_x = MAP_GROUP_SIZE) in;

// Blocks of places; the level before is then the boxes of primitives.
layout(constant_id = 0) const bool MAP_PLACES = false;

layout(set = 0, binding = 0) uniform utextureBuffer map_boxes;
// Sorted; four words per texel.
layout(set = 0, binding = 1) uniform utextureBuffer map_order;
layout(set = 0, binding = 2, scalar) restrict buffer MapBlocks { ivec4 map_blocks_out[]; };

layout(push_constant, scalar) uniform MapBlocksPush {
    uint count;  // blocks of the level before
    uint from;   // the first of them
    uint to;     // the first of this level
} map_push;

void main() {
    uint block = gl_GlobalInvocationID.x;
    uint first = block * MAP_BLOCK;
    if (first >= map_push.count) {
        return;
    }
    uint end = min(first + MAP_BLOCK, map_push.count);
    LbvhBox box = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    for (uint place = first; place < end; ++place) {
        uint at = LBVH_BOX_QUARTERS * (map_push.from + place);
        ivec4 low;
        ivec4 high;
        if (MAP_PLACES) {
            uint primitive = texelFetch(map_order, int(place >> 2))[place & 3u];
            low = ivec4(texelFetch(map_boxes, int(LBVH_BOX_QUARTERS * primitive)));
            high = ivec4(texelFetch(map_boxes, int(LBVH_BOX_QUARTERS * primitive + 1u)));
            map_blocks_out[at] = low;
            map_blocks_out[at + 1u] = high;
        } else {
            low = map_blocks_out[at];
            high = map_blocks_out[at + 1u];
        }
        box = lbvh_union(box, LbvhBox(low.xyz, ivec3(low.w, high.xy)));
    }
    uint at = LBVH_BOX_QUARTERS * (map_push.to + block);
    map_blocks_out[at] = ivec4(box.lower, box.upper.x);
    map_blocks_out[at + 1u] = ivec4(box.upper.yz, 0, 0);
}
