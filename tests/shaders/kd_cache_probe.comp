// What a workgroup has of a kd-tree's top in its shared memory: nodes as traversals read them, marked where they come from there, and boxes.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define KD_CACHES
#include "accel/kd_cache.glsl"

// Added to both words of each node in shared memory.
layout(constant_id = 0) const uint CACHE_PROBE_MARK = 0u;

layout(push_constant, scalar) uniform Push {
    // Nodes of the tree.
    uint count;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer CacheProbeNodes {
    uvec2 cache_probe_nodes[];
};

// Lower and upper corners, of caches that hold boxes.
layout(set = 0, binding = 1, scalar) restrict writeonly buffer CacheProbeBoxes {
    float cache_probe_boxes[];
};

void main() {
    kd_load_cache();
    uint cached = min(push.count, KD_CACHED_NODES);
    for (uint place = gl_LocalInvocationIndex; place < cached; place += gl_WorkGroupSize.x) {
        kd_cached_nodes[place] += uvec2(CACHE_PROBE_MARK);
    }
    barrier();
    for (uint node = gl_LocalInvocationIndex; node < push.count; node += gl_WorkGroupSize.x) {
        cache_probe_nodes[node] = kd_node(node);
    }
    if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES) {
        for (uint i = gl_LocalInvocationIndex; i < 6u * cached; i += gl_WorkGroupSize.x) {
            cache_probe_boxes[i] = kd_cached_boxes[i];
        }
    }
}
