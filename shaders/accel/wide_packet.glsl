// Traversal of the wide hierarchy by the rays of a subgroup together, for rays that go nearly the same way; twin of
// clerestory::accel::wide::packet.
//
// Source: J. Günther, S. Popov, H.-P. Seidel and P. Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet Traversal", IEEE RT 2007 (one stack for a
// packet of a subgroup).
//
// All lanes visit the same nodes, those whose box any of their rays meets, in the order of the first ray; and each lane fetches another texel of a node or of
// a triangle and hands it to the others. So a node costs a fetch of the subgroup, not five. Hits are those of each ray alone: more triangles
// are tested, and the least candidate is the same.
//
// Every branch and loop depends on what the subgroup has agreed on alone, so its lanes stay together from call to return: whole subgroups must call it.
#ifndef CLERESTORY_ACCEL_WIDE_PACKET_GLSL
#define CLERESTORY_ACCEL_WIDE_PACKET_GLSL

#include "accel/wide.glsl"

// Lanes of a subgroup.
layout(constant_id = 112) const uint WIDE_PACKET_LANES = 8u;

const uint WIDE_PACKET_NO_RAY = 0xFFFFFFFFu;

// A texel that a lane has fetched; behind as many as there are lanes, one that all fetch. Macro, since the lane is a literal.
#define WIDE_TEXEL_OF(OWN, TEXEL, I) (I < WIDE_PACKET_LANES ? subgroupBroadcast(OWN, I) : index_texel(TEXEL + I))

// Improves `hit` (no_hit(ray.t_max) at first), where the lane `has_ray`. Returns INDEX_FINISHED, or INDEX_START where the quota has stopped the packet before
// this ray was done: then it has to be traced anew, by itself.
uint wide_packet(Ray ray, bool has_ray, const bool any_hit, inout Hit hit) {
    bool waits = has_ray && is_traceable(ray);
    uvec4 header0 = index_texel(0u);
    uvec4 header1 = index_texel(1u);
    BoxTest boxes = box_test(uintBitsToFloat(header0.xyz), uintBitsToFloat(header1.xyz), ray);
    bvec3 backwards = lessThan(boxes.inverse, vec3(0.0));
    uint own_octant = uint(backwards.x) | uint(backwards.y) << 1 | uint(backwards.z) << 2;
    RayShear shear = ray_shear(ray.origin, ray.direction);
    uint lane = gl_SubgroupInvocationID;
    uint first = subgroupMin(waits ? lane << WIDE_SLOT_BITS | own_octant : WIDE_PACKET_NO_RAY);
    uint octant = first & WIDE_SLOT_MASK;

    uint node = first == WIDE_PACKET_NO_RAY ? INDEX_FINISHED : 0u;
    uint children = 0u;
    uint slots = 0u;
    uint top = 0u;
    uint iterations = 0u;
    if (node != INDEX_FINISHED) {
        do {
            ++iterations;
            uint texel = WIDE_HEADER_TEXELS + WIDE_NODE_TEXELS * node;
            uvec4 own = index_texel(texel + min(lane, WIDE_NODE_TEXELS - 1u));
            uvec4 frame = WIDE_TEXEL_OF(own, texel, 0u);
            uvec4 below = WIDE_TEXEL_OF(own, texel, 1u);
            uvec4 x = WIDE_TEXEL_OF(own, texel, 2u);
            uvec4 y = WIDE_TEXEL_OF(own, texel, 3u);
            uvec4 z = WIDE_TEXEL_OF(own, texel, 4u);
            uint own_met = wide_slots_met(boxes, backwards, frame, x, y, z, ray.t_min, hit.t);
            uint met = subgroupOr(waits ? own_met : 0u) & below.z;
            uint triangles = met & WIDE_TRIANGLE_MASK;
            uint order = wide_in_order(met >> WIDE_INNER_SHIFT, octant);
            bool none_left = (slots & WIDE_ORDER_MASK) == 0u;
            if (order != 0u) {
                if (!none_left) {
                    wide_stack_children[top] = children;
                    wide_stack_slots[top] = slots;
                    ++top;
                }
                children = below.x;
                slots = below.z >> WIDE_INNER_SHIFT << WIDE_SLOTS | order;
            } else if (none_left && top > 0u) {
                --top;
                children = wide_stack_children[top];
                slots = wide_stack_slots[top];
            }
            uint slot = uint(findLSB(slots)) ^ octant;
            uint before = slots >> WIDE_SLOTS & (1u << (slot & WIDE_SLOT_MASK)) - 1u;
            node = (slots & WIDE_ORDER_MASK) != 0u ? children + uint(bitCount(before)) : INDEX_FINISHED;
            slots = (slots & WIDE_ORDER_MASK) != 0u ? slots & slots - 1u : slots;
            if (INDEX_COUNT && lane == 0u) {
                ++index_counters.nodes;
                index_counters.triangles += uint(bitCount(triangles));
            }
            if (triangles != 0u) {
                do {
                    ++iterations;
                    uint earlier = below.z & (1u << findLSB(triangles)) - 1u;
                    triangles &= triangles - 1u;
                    uint at = header0.w + WIDE_TRIANGLE_TEXELS * (below.y + uint(bitCount(earlier)));
                    uvec4 part = index_texel(at + min(lane, WIDE_TRIANGLE_TEXELS - 1u));
                    vec4 q0 = uintBitsToFloat(WIDE_TEXEL_OF(part, at, 0u));
                    vec4 q1 = uintBitsToFloat(WIDE_TEXEL_OF(part, at, 1u));
                    uvec4 q2 = WIDE_TEXEL_OF(part, at, 2u);
                    TriangleHit candidate;
                    bool is_met = intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, uintBitsToFloat(q2.x)), ray.t_min, hit.t, candidate);
                    bool is_better = waits && is_met && (candidate.t < hit.t || q2.y < hit.triangle);
                    hit.t = is_better ? candidate.t : hit.t;
                    hit.barycentrics = is_better ? candidate.barycentrics : hit.barycentrics;
                    hit.triangle = is_better ? q2.y : hit.triangle;
                    waits = waits && !(any_hit && is_better);
                } while (triangles != 0u);
                if (any_hit) {
                    node = subgroupAny(waits) ? node : INDEX_FINISHED;
                }
            }
        } while (node != INDEX_FINISHED && iterations < INDEX_QUOTA);
    }
    index_iterations += iterations;
    if (INDEX_COUNT && lane == 0u) {
        index_counters.iterations += iterations;
    }
    return node == INDEX_FINISHED || !waits ? INDEX_FINISHED : INDEX_START;
}

#endif
