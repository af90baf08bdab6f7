// Caches of kd-trees that a workgroup manages itself, each a specialization: the top levels of the tree in shared memory, with or without boxes;
// the last entries of the stack in registers; a leaf that waits for the next one. Twin of clerestory::accel::kd::cache, which explains them.
//
// KD_CACHES is defined by entry files whose workgroups stay for many rays and call kd_load_cache before the first.
#ifndef CLERESTORY_ACCEL_KD_CACHE_GLSL
#define CLERESTORY_ACCEL_KD_CACHE_GLSL

#include "accel/box_test.glsl"
#include "accel/index_bindings.glsl"

const uint KD_KIND_BITS = 2u;
const uint KD_LEAF = 3u;  // in place of an axis
const uint KD_HEADER_TEXELS = 2u;

const uint KD_STACK_CACHE_NONE = 0u;
const uint KD_STACK_CACHE_HEAD = 1u;
const uint KD_STACK_CACHE_BYTES = 2u;

// Most levels of a node cache, and those whose nodes have a byte for a name.
const uint KD_HEAP_LEVELS = 10u;
const uint KD_BYTE_LEVELS = 8u;

// The oldest of nodes that are four bytes per word, the older word first; 0 for none.
uint kd_oldest_byte(uvec2 bytes) {
    uint word = bytes.x != 0u ? bytes.x : bytes.y;
    return word >> (max(findMSB(word), 0) & ~7);
}

uvec2 kd_without_oldest_byte(uvec2 bytes) {
    uint word = bytes.x != 0u ? bytes.x : bytes.y;
    uint rest = word & ~(0xFFu << (max(findMSB(word), 0) & ~7));
    return bytes.x != 0u ? uvec2(rest, bytes.y) : uvec2(0u, rest);
}

uvec2 kd_fetch_node(uint node) {
    uvec4 pair = index_texel(KD_HEADER_TEXELS + (node >> 1));
    return (node & 1u) == 0u ? pair.xy : pair.zw;
}

#ifdef KD_CACHES

layout(constant_id = 107) const uint KD_CACHE_LEVELS = 0u;
layout(constant_id = 108) const uint KD_STACK_CACHE = KD_STACK_CACHE_NONE;
layout(constant_id = 109) const bool KD_POSTPONES = false;

#define KD_CACHED_NODES (1u << KD_CACHE_LEVELS)
#define KD_CACHED_COORDINATES (KD_STACK_CACHE == KD_STACK_CACHE_BYTES ? 6u << KD_CACHE_LEVELS : 1u)

shared uvec2 kd_cached_nodes[KD_CACHED_NODES];
shared float kd_cached_boxes[KD_CACHED_COORDINATES];

// The box of a node at the top, by its place in the heap: the root is 1, the children of i are 2i and 2i + 1.
void kd_load_box(uint place, vec3 lower, vec3 upper) {
    uint heap = max(place, 1u);
    uint node = 0u;
    for (int level = findMSB(heap) - 1; level >= 0; --level) {
        uvec2 above = kd_fetch_node(node);
        uint axis = above.y & KD_LEAF;
        uint side = heap >> level & 1u;
        if (axis != KD_LEAF) {
            float plane = uintBitsToFloat(above.x);
            if (side == 0u) {
                upper[axis] = plane;
            } else {
                lower[axis] = plane;
            }
            node = (above.y >> KD_KIND_BITS) + side;
        }
    }
    for (uint axis = 0u; axis < 3u; ++axis) {
        kd_cached_boxes[6u * place + axis] = lower[axis];
        kd_cached_boxes[6u * place + 3u + axis] = upper[axis];
    }
}

// Loads the top of the tree. The workgroup waits for itself.
void kd_load_cache() {
    uvec4 lower = index_texel(0u);
    uvec4 upper = index_texel(1u);
    uint nodes = min(KD_CACHED_NODES, 2u * (lower.w - KD_HEADER_TEXELS));
    for (uint place = gl_LocalInvocationIndex; place < nodes; place += gl_WorkGroupSize.x) {
        kd_cached_nodes[place] = kd_fetch_node(place);
        if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES) {
            kd_load_box(place, uintBitsToFloat(lower.xyz), uintBitsToFloat(upper.xyz));
        }
    }
    barrier();
}

uvec2 kd_node(uint node) {
    if (KD_CACHE_LEVELS > 0u && node < KD_CACHED_NODES) {
        return kd_cached_nodes[node];
    }
    return kd_fetch_node(node);
}

// The entry of a cached node: the axis of the plane above it, and where the ray leaves its box.
uvec2 kd_cached_entry(BoxTest boxes, uint node, float t_max) {
    uint above = node >> 1;
    uint axis = kd_cached_nodes[above == 1u ? 0u : above].y & KD_LEAF;
    uint first = 6u * node;
    vec3 lower = vec3(kd_cached_boxes[first], kd_cached_boxes[first + 1u], kd_cached_boxes[first + 2u]);
    vec3 upper = vec3(kd_cached_boxes[first + 3u], kd_cached_boxes[first + 4u], kd_cached_boxes[first + 5u]);
    return uvec2(node << KD_KIND_BITS | axis, floatBitsToUint(min(box_span(boxes, lower, upper).y, t_max)));
}

#else

#define KD_CACHE_LEVELS 0u
#define KD_STACK_CACHE KD_STACK_CACHE_NONE
#define KD_POSTPONES false
#define KD_CACHED_NODES 0u

uvec2 kd_node(uint node) { return kd_fetch_node(node); }

uvec2 kd_cached_entry(BoxTest boxes, uint node, float t_max) { return uvec2(0u); }

#endif

#endif
