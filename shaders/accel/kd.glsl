// Closest-hit and any-hit traversal of kd-trees, by a stack or by a word of flags; twin of clerestory::accel::kd::traverse, which explains the
// schemes, the order of leaves and how a stopped ray goes on.
//
// Each round goes down to a leaf, tests its triangles and finds what is left: three loops, in each of which lanes wait for each other, since
// software drivers run both sides of branches, and a triangle costs ten planes. All of them test at their end whether they go on, since such
// drivers run a loop's body once more where it is tested at the beginning. A subgroup may run as many iterations as its lanes
// have in sum, and the quota must be that much smaller. A ray that it stops returns the flags of what is left; call again with them and the
// same hit. A stack keeps no flags under way: they are read off it where the ray stops, and the way back is gone before the first round, so
// that the loops know nothing of either. A round adds KD_ROUND_ITERATIONS, 2 × KD_MAX_DEPTH and the triangles of a leaf to the quota at most, or with
// KD_POSTPONES, where a leaf waits for the next, KD_PAIR_ITERATIONS instead and the triangles of two leaves; one round may follow it where one leaf is
// left, another where a leaf waits, and each candidate that is asked about is a round of its own.
//
// With CLERESTORY_CANDIDATE_FILTER defined, as a constant that says whether there is a filter, the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
//
// With KD_VOTES defined, by includers that cache, subgroups decide together when leaves are tested; what rays visit then depends on their
// neighbours, and hits do not.
//
// Texels: the box with where triangles begin (lower, triangles | upper, 0), pairs of sibling nodes, triangles as bvh2.glsl has them in the order
// of the leaves, those of several leaves several times. A node is two words, twin of clerestory::accel::kd::KdNode.
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
// Entries that can be read; a stack forgets none.
#define KD_SIZE (KD_FLAGS ? size : top)
// Whether a stack must find flags of what is left, and go back by them.
const bool KD_STACK_STOPS = !KD_FLAGS && INDEX_QUOTA != INDEX_NEVER_STOPS;
#define KD_STACK_RESUMES (KD_STACK_STOPS && INDEX_RESUMES)

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

// A node's children as a ray meets them.
struct KdTurn {
    uint near;
    uint far;
    uint axis;
    float slack;
    bool both;
    bool near_alone;
    // Where the near child ends, if both are met.
    float near_ends;
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

// Whether all that is left begins beyond a hit when a part has ended.
bool ends_beyond(float largest_slack, float ended, float hit) {
    precise float earliest = ended - 2.0 * largest_slack;
    return earliest > hit;
}

bool kd_is_leaf(uvec2 node) { return (node.y & KD_LEAF) == KD_LEAF; }

KdTurn kd_turn(uvec2 node, BoxTest boxes, vec2 span) {
    uint axis = node.y & KD_LEAF;
    uint children = node.y >> KD_KIND_BITS;
    PlaneTest test = plane_test(boxes, axis);
    uint near = near_child(test);
    float near_ends;
    uint met = children_met(test, uintBitsToFloat(node.x), span, near_ends);
    return KdTurn(children + near, children + 1u - near, axis, test.slack, met == KD_MET_BOTH, met == KD_MET_NEAR, near_ends);
}

// Goes to the child that the ray meets first, or to the far one where the near one has ended.
void kd_descend(inout KdDescent at, KdTurn turn, bool far_is_left, float t_min) {
    at.node = turn.near_alone || turn.both && !far_is_left ? turn.near : turn.far;
    if (turn.both && far_is_left) {
        at.span.x = far_begins(turn.slack, turn.near_ends, t_min);
    } else if (turn.both) {
        at.span.y = turn.near_ends;
    }
    at.parent = at.bit;
    at.bit >>= 1;
}

#define KD_COUNT_NODE \
    ++iterations; \
    INDEX_COUNT_ONE(nodes) \
    if (at.node < KD_CACHED_NODES && KD_CACHE_LEVELS > 0u) { \
        INDEX_COUNT_ONE(cached_nodes) \
    }

// Leaves the far child of a turn for later.
#define KD_PUSH(turn) \
    { \
        uvec2 entry = uvec2(turn.far << KD_KIND_BITS | turn.axis, floatBitsToUint(at.span.y)); \
        bool to_stack = KD_CAPACITY > 0u; \
        if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD) { \
            uvec2 spilled = head; \
            head = entry; \
            entry = spilled; \
            to_stack = spilled.x != 0u; \
            INDEX_COUNT_ONE(register_pushes) \
        } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && turn.far < KD_CACHED_NODES) { \
            bool has_room = bytes.x < 1u << 24; \
            bytes = has_room ? uvec2(bytes.x << 8 | turn.far, bytes.y) : uvec2(bytes.x, bytes.y << 8 | turn.far); \
            to_stack = false; \
            INDEX_COUNT_ONE(register_pushes) \
        } \
        if (to_stack) { \
            uint slot = KD_FLAGS ? top % KD_CAPACITY : top; \
            entry_nodes[slot] = entry.x; \
            entry_ends[slot] = entry.y; \
            ++top; \
            size = min(size + 1u, KD_CAPACITY); \
            INDEX_COUNT_ONE(pushes) \
        } \
    }

// On to what is left: sets is_end where that is nothing, or is_beyond where it begins beyond the hit.
#define KD_POP \
    { \
        flags += KD_FLAGS ? at.parent : 0u; \
        bool empty = (KD_CAPACITY == 0u || KD_SIZE == 0u) && head.x == 0u && bytes.x == 0u; \
        if ((KD_FLAGS ? flags == 0u : empty) || ends_beyond(largest_slack, at.span.y, hit.t)) { \
            is_end = true; \
        } else if (empty) { \
            at = restart; \
            can_push_down = KD_PUSH_DOWN; \
            INDEX_COUNT_ONE(restarts) \
        } else { \
            uvec2 entry; \
            if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD && head.x != 0u) { \
                entry = head; \
                head.x = 0u; \
                INDEX_COUNT_ONE(register_pops) \
            } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && top == 0u) { \
                entry = kd_cached_entry(boxes, (bytes.y != 0u ? bytes.y : bytes.x) & 0xFFu, ray.t_max); \
                bytes = bytes.y != 0u ? uvec2(bytes.x, bytes.y >> 8) : uvec2(bytes.x >> 8, 0u); \
                INDEX_COUNT_ONE(register_pops) \
            } else { \
                --top; \
                --size; \
                uint slot = KD_FLAGS ? top % KD_CAPACITY : top; \
                entry = uvec2(entry_nodes[slot], entry_ends[slot]); \
                INDEX_COUNT_ONE(pops) \
            } \
            uint axis = entry.x & KD_LEAF; \
            float begins = far_begins(along_axis(boxes.slack, axis), at.span.y, ray.t_min); \
            /* The carry has set the bit of the node above. */ \
            uint parent = flags & -flags; \
            at = KdDescent(entry.x >> KD_KIND_BITS, vec2(begins, uintBitsToFloat(entry.y)), parent >> 1, parent); \
            is_beyond = begins > hit.t; \
            iterations += is_beyond ? 1u : 0u; \
            can_push_down = false; \
        } \
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
    KdDescent root = KdDescent(0u, vec2(max(scene.x, ray.t_min), min(scene.y, ray.t_max)), KD_ROOT_BIT, 0u);
    // Without triangles the box is empty.
    if (lower.x > upper.x || root.span.x > root.span.y) {
        return INDEX_FINISHED;
    }
    RayShear shear = ray_shear(ray.origin, ray.direction);
    float largest_slack = largest_component(boxes.slack);
    KdDescent at = root;
    KdDescent restart = root;
    bool can_push_down = KD_PUSH_DOWN;
    uint flags = INDEX_RESUMES ? resume : 0u;
    // Node and axis of the plane above it, and the end of its span: two arrays, since software drivers store vectors far more slowly. The bit of
    // its level is told by the flags.
    uint entry_nodes[KD_MAX_DEPTH];
    uint entry_ends[KD_MAX_DEPTH];
    uint top = 0u;
    uint size = 0u;
    uint reference = 0u;
    uint reference_end = 0u;
    // Of caches: the last entry; the last cached nodes, four bytes per word, the older word first; a leaf that waits, its references and their end.
    uvec2 head = uvec2(0u);
    uvec2 bytes = uvec2(0u);
    uvec2 postponed = uvec2(0u);
    bool waits = false;
    bool ends_waiting = false;
    uint iterations = 0u;
    // At a far child that begins beyond the hit.
    bool is_beyond = false;
    if (KD_STACK_RESUMES && resume != INDEX_START) {
        do {
            KD_COUNT_NODE
            KdTurn turn = kd_turn(kd_node(at.node), boxes, at.span);
            bool far_is_left = turn.both && (resume & at.bit) != 0u;
            if (turn.both && !far_is_left) {
                KD_PUSH(turn)
            }
            kd_descend(at, turn, far_is_left, ray.t_min);
            is_beyond = far_is_left && at.span.x > hit.t;
        } while (!is_beyond && at.bit != 0u && (resume & (2u * at.bit - 1u)) != 0u);
    }
    uvec2 node = kd_node(at.node);
    bool is_end = false;
    bool done = false;
    bool stops = false;
    do {
        iterations += KD_POSTPONES ? KD_PAIR_ITERATIONS : KD_ROUND_ITERATIONS;
#ifdef KD_VOTES
        // Until each lane of the subgroup holds a leaf or has seen them all. Those that hold one go on behind it meanwhile, up to the next.
        do {
            bool at_leaf = !is_beyond && kd_is_leaf(node);
            if (!is_end && !(at_leaf && waits)) {
                if (at_leaf || is_beyond) {
                    if (at_leaf) {
                        postponed = uvec2(node.y >> KD_KIND_BITS, (node.y >> KD_KIND_BITS) + node.x);
                        waits = true;
                        INDEX_COUNT_ONE(leaves)
                    }
                    ++iterations;
                    is_beyond = false;
                    KD_POP
                } else {
                    KD_COUNT_NODE
                    KdTurn turn = kd_turn(node, boxes, at.span);
                    if (turn.both) {
                        KD_PUSH(turn)
                    }
                    kd_descend(at, turn, false, ray.t_min);
                }
                node = kd_node(at.node);
            }
        } while (!subgroupAll(waits || is_end));
        reference = postponed.x;
        reference_end = waits ? postponed.y : postponed.x;
        waits = false;
#else
        // Down to a leaf, or to a far child that begins beyond the hit; unless a candidate has interrupted a leaf.
        bool reached = reference == reference_end && !ends_waiting && !is_beyond;
        is_beyond = false;
        if (reached && !kd_is_leaf(node)) {
            do {
                KD_COUNT_NODE
                KdTurn turn = kd_turn(node, boxes, at.span);
                bool far_is_left = KD_FLAGS && turn.both && (flags & at.bit) != 0u;
                if (turn.both && !far_is_left) {
                    if (KD_PUSH_DOWN && can_push_down) {
                        restart = at;
                        can_push_down = false;
                    }
                    KD_PUSH(turn)
                }
                flags |= KD_FLAGS && !turn.both ? at.bit : 0u;
                kd_descend(at, turn, far_is_left, ray.t_min);
                reached = !(far_is_left && at.span.x > hit.t);
                node = kd_node(at.node);
            } while (reached && !kd_is_leaf(node));
        }
        if (reached) {
            reference = node.y >> KD_KIND_BITS;
            reference_end = reference + node.x;
            INDEX_COUNT_ONE(leaves)
        }
#endif
        bool awaiting = false;
        Hit awaited;
        // The second of two leaves, tested if it begins before what is met in the first.
        uvec2 second = uvec2(0u);
#ifndef KD_VOTES
        if (KD_POSTPONES && reached) {
            second = uvec2(reference, reference_end);
            uvec2 first = waits ? postponed : uvec2(0u);
            postponed = second;
            second = waits ? second : uvec2(0u);
            reference = first.x;
            reference_end = first.y;
            waits = !waits;
        }
#endif
        for (uint leaf = 0u; leaf < (KD_POSTPONES ? 2u : 1u); ++leaf) {
            if (reference != reference_end && !done) {
                bool more;
                do {
                    ++iterations;
                    INDEX_COUNT_ONE(triangles)
                    uint texel = header0.w + KD_TRIANGLE_TEXELS * reference;
                    vec4 q0 = uintBitsToFloat(index_texel(texel));
                    vec4 q1 = uintBitsToFloat(index_texel(texel + 1u));
                    uvec4 q2 = index_texel(texel + 2u);
                    ++reference;
                    more = reference != reference_end;
                    TriangleHit candidate;
                    // A triangle of several leaves is met again with the same hit, which is not better.
                    if (intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, uintBitsToFloat(q2.x)), ray.t_min, hit.t, candidate)
                        && (candidate.t < hit.t || q2.y < hit.triangle)) {
                        awaited = Hit(candidate.t, candidate.barycentrics, q2.y);
#ifdef CLERESTORY_CANDIDATE_FILTER
                        if (CLERESTORY_CANDIDATE_FILTER) {
                            awaiting = true;
                            more = false;
                        } else
#endif
                        {
                            hit = awaited;
                            done = any_hit;
                            more = more && !any_hit;
                        }
                    }
                } while (more);
            }
            if (KD_POSTPONES && leaf == 0u && !done) {
                reference = second.x;
                reference_end = at.span.x <= hit.t ? second.y : second.x;
            }
        }
#ifdef CLERESTORY_CANDIDATE_FILTER
        // Outside of the loop, where lanes wait for each other with their candidates.
        if (CLERESTORY_CANDIDATE_FILTER && awaiting && accept_candidate(awaited.triangle, awaited.barycentrics)) {
            hit = awaited;
            done = any_hit;
        }
#endif
#ifdef KD_VOTES
        done = done || is_end;
        is_beyond = is_beyond || at.span.x > hit.t;
#else
        // On to what is left, skipping what begins beyond the hit.
        bool leaves = !done && reference == reference_end && !ends_waiting;
        done = done || ends_waiting;
        if (leaves) {
            do {
                is_beyond = false;
                KD_POP
            } while (is_beyond);
            if (is_end) {
                ends_waiting = KD_POSTPONES && waits;
                done = !ends_waiting;
                reference = postponed.x;
                reference_end = ends_waiting ? postponed.y : postponed.x;
            }
            node = kd_node(at.node);
        }
#endif
        // One leaf that is left is not worth stopping at; nor could flags say so of one at the lowest level, where they read as the end.
        bool one_leaf = KD_FLAGS ? flags == INDEX_FINISHED : kd_is_leaf(node) && top == 0u && head.x == 0u && bytes.x == 0u;
        // Neither does a ray stop while a leaf waits, or within one.
        stops = INDEX_QUOTA != INDEX_NEVER_STOPS && iterations >= INDEX_QUOTA && !one_leaf && !waits && reference == reference_end;
    } while (!done && !stops);
    if (KD_STACK_STOPS && stops && !done) {
        if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD && head.x != 0u) {
            entry_nodes[top++] = head.x;
        }
        // From the root again: a far child that is an entry, the oldest first, is left; any other has been gone to.
        flags = 0u;
        uint oldest = 0u;
        KdDescent way = root;
        do {
            KdTurn turn = kd_turn(kd_node(way.node), boxes, way.span);
            bool is_entry = oldest < top && entry_nodes[oldest] >> KD_KIND_BITS == turn.far;
            if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && turn.far < KD_CACHED_NODES) {
                is_entry = kd_oldest_byte(bytes) == turn.far;
                bytes = is_entry ? kd_without_oldest_byte(bytes) : bytes;
            } else {
                oldest += is_entry ? 1u : 0u;
            }
            flags |= is_entry ? 0u : way.bit;
            kd_descend(way, turn, !is_entry, ray.t_min);
        } while (way.node != at.node);
    }
    if (INDEX_COUNT) {
        index_counters.iterations += iterations;
    }
    return done ? INDEX_FINISHED : flags;
}

#endif
