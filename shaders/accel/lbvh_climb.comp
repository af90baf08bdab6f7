// Fifth stage of the linear hierarchy: the nodes that reach into several runs.
//
// An invocation goes through what its run has left, and arrives at each of these nodes for one of its children. The first to arrive there
// ends, the second joins both and goes on to the parent: nobody waits, so nothing is asked of the scheduler, and which of both it is does
// not show in the tree (T. Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", 2012). The host fills
// `lbvh_arrival_counters` with zero.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh_subtree.glsl"
#include "accel/lbvh_fence.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 5, scalar) restrict coherent buffer LbvhArrivalCounters { uint lbvh_arrival_counters[]; };

// From a node at which a child is ready.
void climb(uint node) {
    bool climbing = true;
    for (uint i = 0u; climbing && i < LBVH_MAX_ASCENT; ++i) {
        lbvh_fence();
        climbing = atomicAdd(lbvh_arrival_counters[node], 1u) != 0u;
        lbvh_fence();
        if (climbing) {
            LbvhSubtree own = lbvh_join(lbvh_load_child(node, 0u), lbvh_load_child(node, 1u), node);
            climbing = !lbvh_is_root(own);
            if (climbing) {
                bool is_left = own.right_level < own.left_level;
                uint slot = node;
                node = is_left ? own.last : own.first - 1u;
                lbvh_store_child(node, is_left ? 0u : 1u, own, slot);
                lbvh_store_summary(node, is_left ? 0u : 1u, own);
            }
        }
    }
}

void main() {
    uint run = gl_GlobalInvocationID.x;
    if (run >= lbvh_push.runs) {
        return;
    }
    uint left = lbvh_pending[run];
    for (uint turn = 0u; turn < left; ++turn) {
        climb(lbvh_pending[lbvh_push.runs * (1u + turn) + run]);
    }
}
