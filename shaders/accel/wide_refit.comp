// Second stage of refitting a wide hierarchy: grids and boxes of the nodes of one level, from what the level below has left; twin of
// clerestory::accel::wide::refit.
//
// A dispatch a level, the deepest first: nobody waits, and nothing is counted.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/wide_layout.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict buffer WideTexels { uvec4 wide_texels[]; };
// Nodes by their levels.
layout(set = 0, binding = 1, scalar) restrict readonly buffer WideLevels { uint wide_levels[]; };
// Boxes of nodes, as ordered integers in LBVH_BOX_QUARTERS quarters.
layout(set = 0, binding = 2, scalar) restrict buffer WideBoxes { ivec4 wide_boxes[]; };

layout(push_constant, scalar) uniform WideRefitPush {
    // The level's first node, and how many.
    uint begin;
    uint count;
} wide_push;

#include "accel/wide_frame.glsl"

LbvhBox wide_with_corner(LbvhBox box, uvec3 corner) {
    ivec3 place = ordered_integers(uintBitsToFloat(corner));
    return lbvh_union(box, LbvhBox(place, place));
}

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= wide_push.count) {
        return;
    }
    uint node = wide_levels[wide_push.begin + i];
    uint texel = WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * node;
    uvec4 below = wide_texels[texel + 1u];
    uint triangles = wide_texels[0].w;
    const LbvhBox none = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    LbvhBox all = none;
    LbvhBox boxes[WIDE_SLOTS];
    uint occupied = 0u;
    uint child = below.x;
    uint triangle = triangles + WIDE_TRIANGLE_TEXELS * below.y;
    for (uint slot = 0u; slot < WIDE_SLOTS; ++slot) {
        bool is_inner = (below.z >> (WIDE_INNER_SHIFT + slot) & 1u) != 0u;
        uint count = bitCount(below.z >> WIDE_LEAF_SIZE * slot & ((1u << WIDE_LEAF_SIZE) - 1u));
        LbvhBox box = none;
        if (is_inner) {
            ivec4 low = wide_boxes[LBVH_BOX_QUARTERS * child];
            box = LbvhBox(low.xyz, ivec3(low.w, wide_boxes[LBVH_BOX_QUARTERS * child + 1u].xy));
            ++child;
        }
        for (uint j = 0u; j < count; ++j) {
            uvec4 first = wide_texels[triangle];
            uvec4 second = wide_texels[triangle + 1u];
            uint last = wide_texels[triangle + 2u].x;
            box = wide_with_corner(box, first.xyz);
            box = wide_with_corner(box, uvec3(first.w, second.xy));
            box = wide_with_corner(box, uvec3(second.zw, last));
            triangle += WIDE_TRIANGLE_TEXELS;
        }
        occupied |= is_inner || count > 0u ? 1u << slot : 0u;
        boxes[slot] = box;
        all = lbvh_union(all, box);
    }
    wide_boxes[LBVH_BOX_QUARTERS * node] = ivec4(all.lower, all.upper.x);
    wide_boxes[LBVH_BOX_QUARTERS * node + 1u] = ivec4(all.upper.yz, 0, 0);
    wide_set_boxes(texel, all, occupied, boxes);
    if (node == 0u) {
        wide_texels[0] = uvec4(floatBitsToUint(ordered_floats(all.lower)), triangles);
        wide_texels[1] = uvec4(floatBitsToUint(ordered_floats(all.upper)), 0u);
    }
}
