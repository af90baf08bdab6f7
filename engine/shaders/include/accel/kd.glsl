// Closest-hit and any-hit traversal of kd-trees, by a stack or by a word of flags; twin of clerestory::accel::kd::traverse, which explains the
// schemes, the order of leaves and how a stopped ray goes on.
//
// Each round goes down to a leaf, tests its triangles and finds what is left: three loops, in each of which lanes wait for each other, since
// software drivers run both sides of branches, and a triangle costs ten planes. A subgroup may therefore run as many iterations as its lanes
// have in sum, and the quota must be that much smaller. A ray that it stops returns the flags of what is left; call again with them and the
// same hit. A round adds KD_ROUND_ITERATIONS, 2 × KD_MAX_DEPTH and the triangles of a leaf to the quota at most; two rounds may follow it, where
// flags read as the end and where a leaf waits, and each candidate that is asked about is a round of its own.
//
// With CLERESTORY_CANDIDATE_FILTER defined the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
//
// Texels: the box with where references and triangles begin (lower, references | upper, triangles), pairs of sibling nodes, references of leaves
// four a texel, triangles as bvh2.glsl has them. A node is two words, twin of clerestory::accel::kd::KdNode.
#ifndef CLERESTORY_ACCEL_KD_GLSL
#define CLERESTORY_ACCEL_KD_GLSL

#include "accel/box_test.glsl"
#include "accel/index_bindings.glsl"
#include "accel/kd_cache.glsl"
#include "accel/triangle.glsl"

// The scheme: a stack, or flags with restarts at the root or at the lowest node that holds all that is left, and a ring of entries.
layout(constant_id = 103) const bool KD_FLAGS = false;
layout(constant_id = 104) const bool KD_PUSH_DOWN = false;
layout(constant_id = 105) const uint KD_SHORT_STACK = 0u;

const uint KD_MAX_DEPTH = 32u;
const uint KD_REFERENCES_PER_TEXEL = 4u;
const uint KD_TRIANGLE_TEXELS = 3u;
const uint KD_ROOT_BIT = 0x80000000u;
// Iterations of a round beside its nodes, triangles and skipped subtrees: the round, the leaf, what is left, and the ends of all loops.
const uint KD_ROUND_ITERATIONS = 8u;
// The same of rounds that test two leaves.
const uint KD_PAIR_ITERATIONS = 10u;

const uint KD_MET_NEAR = 0u;
const uint KD_MET_FAR = 1u;
const uint KD_MET_BOTH = 2u;

#define KD_CAPACITY (KD_FLAGS ? KD_SHORT_STACK : KD_MAX_DEPTH)
// A stack that never stops needs no flags.
const bool KD_KEEPS_FLAGS = KD_FLAGS || INDEX_QUOTA != INDEX_NEVER_STOPS;

// The box test along one axis.
struct PlaneTest {
    float origin;
    float inverse;
    float slack;
};

// A place to descend from: node, span, bits of its level and of the one above (0 at the root).
struct KdDescent {
    uint node;
    vec2 span;
    uint bit;
    uint parent;
};

float along_axis(vec3 v, uint axis) { return axis == 0u ? v.x : axis == 1u ? v.y : v.z; }

PlaneTest plane_test(BoxTest boxes, uint axis) {
    return PlaneTest(along_axis(boxes.origin, axis), along_axis(boxes.inverse, axis), along_axis(boxes.slack, axis));
}

// Which of the two children is near: 0 for that below the plane.
uint near_child(PlaneTest test) { return test.inverse < 0.0 ? 1u : 0u; }

// Which children a ray meets within the span of their node, and where the near one ends. `precise`, since restarts must find the same.
uint children_met(PlaneTest test, float plane, vec2 span, out float near_ends) {
    precise float t = (plane - test.origin) * test.inverse;
    precise float early = t - test.slack;
    precise float late = t + test.slack;
    near_ends = min(span.y, late);
    return early > span.y ? KD_MET_NEAR : late < span.x ? KD_MET_FAR : KD_MET_BOTH;
}

// Where the far child begins when the near one has ended. A function of this alone, so that stack entries need not hold it.
float far_begins(float slack, float near_ended, float t_min) {
    precise float begins = near_ended - 2.0 * slack;
    return max(begins, t_min);
}

// Traverses from `resume` on (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns INDEX_FINISHED or where to go on.
uint kd_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    if (resume == INDEX_FINISHED || !is_traceable(ray)) {
        return INDEX_FINISHED;
    }
    uvec4 header0 = index_texel(0u);
    uvec4 header1 = index_texel(1u);
    vec3 lower = uintBitsToFloat(header0.xyz);
    vec3 upper = uintBitsToFloat(header1.xyz);
    BoxTest boxes = box_test(lower, upper, ray);
    vec2 scene = box_span(boxes, lower, upper);
    KdDescent at = KdDescent(0u, vec2(max(scene.x, ray.t_min), min(scene.y, ray.t_max)), KD_ROOT_BIT, 0u);
    // Without triangles the box is empty.
    if (lower.x > upper.x || at.span.x > at.span.y) {
        return INDEX_FINISHED;
    }
    RayShear shear = ray_shear(ray.origin, ray.direction);
    KdDescent restart = at;
    bool can_push_down = KD_PUSH_DOWN;
    uint flags = INDEX_RESUMES ? resume : 0u;
    // Node and axis of the plane above it, and the end of its span. The bit of its level is told by the flags.
    uvec2 entries[KD_MAX_DEPTH];
    uint top = 0u;
    uint size = 0u;
    uint reference = 0u;
    uint reference_end = 0u;
    // Of caches: the last entry; the last cached nodes, four bytes a word, the older word first; a leaf that waits, its references and their end.
    uvec2 head = uvec2(0u);
    uvec2 bytes = uvec2(0u);
    uvec2 postponed = uvec2(0u);
    bool waits = false;
    bool ends_waiting = false;
    uint iterations = 0u;
    bool done = false;
    do {
        iterations += KD_POSTPONES ? KD_PAIR_ITERATIONS : KD_ROUND_ITERATIONS;
        // Down to a leaf, or to a far child that begins beyond the hit; unless a candidate has interrupted a leaf.
        bool descends = reference == reference_end && !ends_waiting;
        bool reached = false;
        while (descends) {
            uvec2 node = kd_node(at.node);
            uint axis = node.y & KD_LEAF;
            uint children = node.y >> KD_KIND_BITS;
            if (axis == KD_LEAF) {
                reference = children;
                reference_end = children + node.x;
                descends = false;
                reached = true;
                INDEX_COUNT_ONE(leaves)
            } else {
                ++iterations;
                INDEX_COUNT_ONE(nodes)
                if (at.node < KD_CACHED_NODES && KD_CACHE_LEVELS > 0u) {
                    INDEX_COUNT_ONE(cached_nodes)
                }
                PlaneTest test = plane_test(boxes, axis);
                uint near = near_child(test);
                float near_ends;
                uint met = children_met(test, uintBitsToFloat(node.x), at.span, near_ends);
                bool both = met == KD_MET_BOTH;
                // Of a stack only on the way back to where a ray has stopped.
                bool far_is_left = (KD_FLAGS || KD_KEEPS_FLAGS && INDEX_RESUMES) && both && (flags & at.bit) != 0u;
                bool takes_near = met == KD_MET_NEAR || both && !far_is_left;
                if (both && !far_is_left) {
                    if (KD_PUSH_DOWN && can_push_down) {
                        restart = at;
                        can_push_down = false;
                    }
                    uint far = children + 1u - near;
                    uvec2 entry = uvec2(far << KD_KIND_BITS | axis, floatBitsToUint(at.span.y));
                    bool to_stack = KD_CAPACITY > 0u;
                    if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD) {
                        uvec2 spilled = head;
                        head = entry;
                        entry = spilled;
                        to_stack = spilled.x != 0u;
                        INDEX_COUNT_ONE(register_pushes)
                    } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && far < KD_CACHED_NODES) {
                        bool has_room = bytes.x < 1u << 24;
                        bytes = has_room ? uvec2(bytes.x << 8 | far, bytes.y) : uvec2(bytes.x, bytes.y << 8 | far);
                        to_stack = false;
                        INDEX_COUNT_ONE(register_pushes)
                    }
                    if (to_stack) {
                        entries[KD_FLAGS ? top % KD_CAPACITY : top] = entry;
                        ++top;
                        size = min(size + 1u, KD_CAPACITY);
                        INDEX_COUNT_ONE(pushes)
                    }
                    at.span.y = near_ends;
                }
                flags |= KD_KEEPS_FLAGS && !both ? at.bit : 0u;
                at.span.x = far_is_left ? far_begins(test.slack, near_ends, ray.t_min) : at.span.x;
                descends = !(far_is_left && at.span.x > hit.t);
                at.parent = at.bit;
                at.node = children + (takes_near ? near : 1u - near);
                at.bit >>= 1;
            }
        }
        bool awaiting = false;
        Hit awaited;
        // The second of two leaves, tested if it begins before what is met in the first.
        uvec2 second = uvec2(0u);
        if (KD_POSTPONES && reached) {
            second = uvec2(reference, reference_end);
            uvec2 first = waits ? postponed : uvec2(0u);
            postponed = second;
            second = waits ? second : uvec2(0u);
            reference = first.x;
            reference_end = first.y;
            waits = !waits;
        }
        for (uint leaf = 0u; leaf < (KD_POSTPONES ? 2u : 1u); ++leaf) {
            while (reference != reference_end && !awaiting && !done) {
                ++iterations;
                INDEX_COUNT_ONE(triangles)
                uint place = index_texel(header0.w + reference / KD_REFERENCES_PER_TEXEL)[reference % KD_REFERENCES_PER_TEXEL];
                uint texel = header1.w + KD_TRIANGLE_TEXELS * place;
                vec4 q0 = uintBitsToFloat(index_texel(texel));
                vec4 q1 = uintBitsToFloat(index_texel(texel + 1u));
                uvec4 q2 = index_texel(texel + 2u);
                ++reference;
                TriangleHit candidate;
                // A triangle of several leaves is met again with the same hit, which is not better.
                if (intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, uintBitsToFloat(q2.x)), ray.t_min, hit.t, candidate)
                    && (candidate.t < hit.t || q2.y < hit.triangle)) {
                    awaited = Hit(candidate.t, candidate.barycentrics, q2.y);
#ifdef CLERESTORY_CANDIDATE_FILTER
                    awaiting = true;
#else
                    hit = awaited;
                    done = any_hit;
#endif
                }
        }
        if (KD_POSTPONES && leaf == 0u && !done) {
            reference = second.x;
            reference_end = at.span.x <= hit.t ? second.y : second.x;
        }
        }
#ifdef CLERESTORY_CANDIDATE_FILTER
        // Outside of the loop, where lanes wait for each other with their candidates.
        if (awaiting && accept_candidate(awaited.triangle, awaited.barycentrics)) {
            hit = awaited;
            done = any_hit;
        }
#endif
        // On to what is left, skipping what begins beyond the hit.
        bool leaves = !done && reference == reference_end && !ends_waiting;
        done = done || ends_waiting;
        while (leaves) {
            flags += KD_KEEPS_FLAGS ? at.parent : 0u;
            bool empty = (KD_CAPACITY == 0u || size == 0u) && head.x == 0u && bytes.x == 0u;
            if (KD_KEEPS_FLAGS ? flags == 0u : empty) {
                ends_waiting = KD_POSTPONES && waits;
                done = !ends_waiting;
                leaves = false;
                reference = postponed.x;
                reference_end = ends_waiting ? postponed.y : postponed.x;
            } else if (empty) {
                at = restart;
                can_push_down = KD_PUSH_DOWN;
                leaves = false;
                INDEX_COUNT_ONE(restarts)
            } else {
                uvec2 entry;
                if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD && head.x != 0u) {
                    entry = head;
                    head.x = 0u;
                    INDEX_COUNT_ONE(register_pops)
                } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && size == 0u) {
                    entry = kd_cached_entry(boxes, (bytes.y != 0u ? bytes.y : bytes.x) & 0xFFu, ray.t_max);
                    bytes = bytes.y != 0u ? uvec2(bytes.x, bytes.y >> 8) : uvec2(bytes.x >> 8, 0u);
                    INDEX_COUNT_ONE(register_pops)
                } else {
                    --top;
                    --size;
                    entry = entries[KD_FLAGS ? top % KD_CAPACITY : top];
                    INDEX_COUNT_ONE(pops)
                }
                uint axis = entry.x & KD_LEAF;
                float begins = far_begins(along_axis(boxes.slack, axis), at.span.y, ray.t_min);
                // The carry has set the bit of the node above.
                uint parent = flags & -flags;
                at = KdDescent(entry.x >> KD_KIND_BITS, vec2(begins, uintBitsToFloat(entry.y)), parent >> 1, parent);
                leaves = begins > hit.t;
                iterations += leaves ? 1u : 0u;
                can_push_down = false;
            }
        }
        // Flags that read as the end say that one leaf is left, at the lowest level: not worth stopping at.
        // Neither does a ray stop while a leaf waits, or within one.
    } while (!done && (iterations < INDEX_QUOTA || flags == INDEX_FINISHED || waits || reference != reference_end));
    if (INDEX_COUNT) {
        index_counters.iterations += iterations;
    }
    return done ? INDEX_FINISHED : flags;
}

#endif
