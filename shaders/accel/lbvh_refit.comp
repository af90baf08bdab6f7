// Second stage of refitting: boxes of moved triangles from the leaves up; the tree stays what it is. Twin of
// clerestory::accel::lbvh::refit.
//
// One invocation per child of a node: those of leaves climb, and the second to arrive at a node goes on. The host fills `lbvh_arrival_counters` with
// zero.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/lbvh_fence.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict coherent buffer LbvhWords { uint lbvh_words[]; };
layout(set = 0, binding = 1, scalar) restrict coherent buffer LbvhArrivalCounters { uint lbvh_arrival_counters[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer LbvhStateBlock { LbvhState lbvh_state; };

ivec3 lbvh_load(uint at) {
    return ordered_integers(uintBitsToFloat(uvec3(lbvh_words[at], lbvh_words[at + 1u], lbvh_words[at + 2u])));
}

void main() {
    uint node = gl_GlobalInvocationID.x >> 1;
    uint side = gl_GlobalInvocationID.x & 1u;
    uint nodes = lbvh_state.nodes;
    if (node >= nodes) {
        return;
    }
    uint word = lbvh_words[BVH2_NODE_WORDS * node + 12u + side];
    uint count = word & BVH2_COUNT_MASK;
    uint triangle = BVH2_NODE_WORDS * nodes + BVH2_TRIANGLE_WORDS * (word >> BVH2_COUNT_BITS);
    LbvhBox box = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    for (uint i = 0u; i < count; ++i) {
        for (uint corner = 0u; corner < 3u; ++corner) {
            ivec3 place = lbvh_load(triangle + BVH2_TRIANGLE_WORDS * i + 3u * corner);
            box = lbvh_union(box, LbvhBox(place, place));
        }
    }
    bool climbing = count > 0u;
    for (uint level = 0u; climbing && level < LBVH_MAX_ASCENT; ++level) {
        uint at = BVH2_NODE_WORDS * node;
        uvec3 lower = floatBitsToUint(ordered_floats(box.lower));
        uvec3 upper = floatBitsToUint(ordered_floats(box.upper));
        uint own = at + 6u * side;
        lbvh_words[own] = lower.x;
        lbvh_words[own + 1u] = lower.y;
        lbvh_words[own + 2u] = lower.z;
        lbvh_words[own + 3u] = upper.x;
        lbvh_words[own + 4u] = upper.y;
        lbvh_words[own + 5u] = upper.z;
        lbvh_fence();
        bool is_second = atomicAdd(lbvh_arrival_counters[node], 1u) != 0u;
        lbvh_fence();
        climbing = is_second && node != 0u;
        if (climbing) {
            uint other = at + 6u * (1u - side);
            box = lbvh_union(box, LbvhBox(lbvh_load(other), lbvh_load(other + 3u)));
            uint parent = lbvh_words[at + 14u];
            node = parent >> 1;
            side = parent & 1u;
        }
    }
}
