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

// What stays the same on a ray's way.
struct KdRay {
    BoxTest boxes;
    float largest_slack;
    float t_min;
    float t_max;
};

// The way of a ray through the leaves, twin of Walk and its Entries.
struct KdWalk {
    KdDescent at;
    // Where restarts begin.
    KdDescent restart;
    bool can_push_down;
    uint flags;
    // Place of the next entry, and how many can be read of a ring.
    uint top;
    uint size;
    // Of caches: the last entry; the last cached nodes, four bytes per word, the older word first.
    uvec2 head;
    uvec2 bytes;
    // Nothing is left.
    bool is_end;
    // At a far child that begins beyond the hit.
    bool is_beyond;
    uint iterations;
};

// Node and axis of the plane above it, and the end of its span: two arrays, since software drivers store vectors far more slowly. The bit of
// its level is told by the flags. Not in KdWalk, since a struct is copied into each call.
uint kd_entry_nodes[KD_MAX_DEPTH];
uint kd_entry_ends[KD_MAX_DEPTH];

void kd_count_node(inout KdWalk walk) {
    ++walk.iterations;
    INDEX_COUNT_ONE(nodes)
    if (walk.at.node < KD_CACHED_NODES && KD_CACHE_LEVELS > 0u) {
        INDEX_COUNT_ONE(cached_nodes)
    }
}

// Leaves the far child of a turn for later.
void kd_push(inout KdWalk walk, KdTurn turn) {
    uvec2 entry = uvec2(turn.far << KD_KIND_BITS | turn.axis, floatBitsToUint(walk.at.span.y));
    bool to_stack = KD_CAPACITY > 0u;
    if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD) {
        uvec2 spilled = walk.head;
        walk.head = entry;
        entry = spilled;
        to_stack = spilled.x != 0u;
        INDEX_COUNT_ONE(register_pushes)
    } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && turn.far < KD_CACHED_NODES) {
        uvec2 bytes = walk.bytes;
        bool has_room = bytes.x < 1u << 24;
        walk.bytes = has_room ? uvec2(bytes.x << 8 | turn.far, bytes.y) : uvec2(bytes.x, bytes.y << 8 | turn.far);
        to_stack = false;
        INDEX_COUNT_ONE(register_pushes)
    }
    if (to_stack) {
        uint slot = KD_FLAGS ? walk.top % KD_CAPACITY : walk.top;
        kd_entry_nodes[slot] = entry.x;
        kd_entry_ends[slot] = entry.y;
        ++walk.top;
        walk.size = min(walk.size + 1u, KD_CAPACITY);
        INDEX_COUNT_ONE(pushes)
    }
}

// On to what is left: sets is_end where that is nothing, or is_beyond where it begins beyond the hit.
void kd_pop(inout KdWalk walk, KdRay ray, float hit) {
    walk.flags += KD_FLAGS ? walk.at.parent : 0u;
    uvec2 head = walk.head;
    uvec2 bytes = walk.bytes;
    // A stack forgets none of its entries.
    uint size = KD_FLAGS ? walk.size : walk.top;
    bool empty = (KD_CAPACITY == 0u || size == 0u) && head.x == 0u && bytes.x == 0u;
    if ((KD_FLAGS ? walk.flags == 0u : empty) || ends_beyond(ray.largest_slack, walk.at.span.y, hit)) {
        walk.is_end = true;
    } else if (empty) {
        walk.at = walk.restart;
        walk.can_push_down = KD_PUSH_DOWN;
        INDEX_COUNT_ONE(restarts)
    } else {
        uvec2 entry;
        if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD && head.x != 0u) {
            entry = head;
            walk.head.x = 0u;
            INDEX_COUNT_ONE(register_pops)
        } else if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && walk.top == 0u) {
            entry = kd_cached_entry(ray.boxes, (bytes.y != 0u ? bytes.y : bytes.x) & 0xFFu, ray.t_max);
            walk.bytes = bytes.y != 0u ? uvec2(bytes.x, bytes.y >> 8) : uvec2(bytes.x >> 8, 0u);
            INDEX_COUNT_ONE(register_pops)
        } else {
            --walk.top;
            --walk.size;
            uint slot = KD_FLAGS ? walk.top % KD_CAPACITY : walk.top;
            entry = uvec2(kd_entry_nodes[slot], kd_entry_ends[slot]);
            INDEX_COUNT_ONE(pops)
        }
        uint axis = entry.x & KD_LEAF;
        float begins = far_begins(along_axis(ray.boxes.slack, axis), walk.at.span.y, ray.t_min);
        // The carry has set the bit of the node above.
        uint parent = walk.flags & -walk.flags;
        walk.at = KdDescent(entry.x >> KD_KIND_BITS, vec2(begins, uintBitsToFloat(entry.y)), parent >> 1, parent);
        walk.is_beyond = begins > hit;
        walk.iterations += walk.is_beyond ? 1u : 0u;
        walk.can_push_down = false;
    }
}

// Back to where a stack has stopped, by the flags of what was left.
void kd_resume(inout KdWalk walk, KdRay ray, uint resume, float hit) {
    do {
        kd_count_node(walk);
        KdTurn turn = kd_turn(kd_node(walk.at.node), ray.boxes, walk.at.span);
        bool far_is_left = turn.both && (resume & walk.at.bit) != 0u;
        if (turn.both && !far_is_left) {
            kd_push(walk, turn);
        }
        kd_descend(walk.at, turn, far_is_left, ray.t_min);
        walk.is_beyond = far_is_left && walk.at.span.x > hit;
    } while (!walk.is_beyond && walk.at.bit != 0u && (resume & (2u * walk.at.bit - 1u)) != 0u);
}

// Down from an inner node to a leaf, or to a far child that begins beyond the hit; whether it is a leaf.
bool kd_go_down(inout KdWalk walk, inout uvec2 node, KdRay ray, float hit) {
    bool reached;
    do {
        kd_count_node(walk);
        KdTurn turn = kd_turn(node, ray.boxes, walk.at.span);
        bool far_is_left = KD_FLAGS && turn.both && (walk.flags & walk.at.bit) != 0u;
        if (turn.both && !far_is_left) {
            if (KD_PUSH_DOWN && walk.can_push_down) {
                walk.restart = walk.at;
                walk.can_push_down = false;
            }
            kd_push(walk, turn);
        }
        walk.flags |= KD_FLAGS && !turn.both ? walk.at.bit : 0u;
        kd_descend(walk.at, turn, far_is_left, ray.t_min);
        reached = !(far_is_left && walk.at.span.x > hit);
        node = kd_node(walk.at.node);
    } while (reached && !kd_is_leaf(node));
    return reached;
}

// The flags of what a stack has left. From the root again: a far child that is an entry, the oldest first, is left; any other has been gone to.
uint kd_flags_of_stack(inout KdWalk walk, KdDescent root, KdRay ray) {
    if (KD_STACK_CACHE == KD_STACK_CACHE_HEAD && walk.head.x != 0u) {
        kd_entry_nodes[walk.top++] = walk.head.x;
    }
    uint flags = 0u;
    uint oldest = 0u;
    KdDescent way = root;
    do {
        KdTurn turn = kd_turn(kd_node(way.node), ray.boxes, way.span);
        bool is_entry = oldest < walk.top && kd_entry_nodes[oldest] >> KD_KIND_BITS == turn.far;
        if (KD_STACK_CACHE == KD_STACK_CACHE_BYTES && turn.far < KD_CACHED_NODES) {
            is_entry = kd_oldest_byte(walk.bytes) == turn.far;
            walk.bytes = is_entry ? kd_without_oldest_byte(walk.bytes) : walk.bytes;
        } else {
            oldest += is_entry ? 1u : 0u;
        }
        flags |= is_entry ? 0u : way.bit;
        kd_descend(way, turn, !is_entry, ray.t_min);
    } while (way.node != walk.at.node);
    return flags;
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
    KdRay along = KdRay(boxes, largest_component(boxes.slack), ray.t_min, ray.t_max);
    KdWalk walk = KdWalk(root, root, KD_PUSH_DOWN, INDEX_RESUMES ? resume : 0u, 0u, 0u, uvec2(0u), uvec2(0u), false, false, 0u);
    uint reference = 0u;
    uint reference_end = 0u;
    // A leaf that waits: its references and their end.
    uvec2 postponed = uvec2(0u);
    bool waits = false;
    bool ends_waiting = false;
    if (KD_STACK_RESUMES && resume != INDEX_START) {
        kd_resume(walk, along, resume, hit.t);
    }
    uvec2 node = kd_node(walk.at.node);
    bool done = false;
    bool stops = false;
    do {
        walk.iterations += KD_POSTPONES ? KD_PAIR_ITERATIONS : KD_ROUND_ITERATIONS;
#ifdef KD_VOTES
        // Until each lane of the subgroup holds a leaf or has seen them all. Those that hold one go on behind it meanwhile, up to the next.
        do {
            bool at_leaf = !walk.is_beyond && kd_is_leaf(node);
            if (!walk.is_end && !(at_leaf && waits)) {
                if (at_leaf || walk.is_beyond) {
                    if (at_leaf) {
                        postponed = uvec2(node.y >> KD_KIND_BITS, (node.y >> KD_KIND_BITS) + node.x);
                        waits = true;
                        INDEX_COUNT_ONE(leaves)
                    }
                    ++walk.iterations;
                    walk.is_beyond = false;
                    kd_pop(walk, along, hit.t);
                } else {
                    kd_count_node(walk);
                    KdTurn turn = kd_turn(node, boxes, walk.at.span);
                    if (turn.both) {
                        kd_push(walk, turn);
                    }
                    kd_descend(walk.at, turn, false, ray.t_min);
                }
                node = kd_node(walk.at.node);
            }
        } while (!subgroupAll(waits || walk.is_end));
        reference = postponed.x;
        reference_end = waits ? postponed.y : postponed.x;
        waits = false;
#else
        // Down to a leaf, or to a far child that begins beyond the hit; unless a candidate has interrupted a leaf.
        bool reached = !walk.is_beyond && reference == reference_end && !ends_waiting;
        walk.is_beyond = false;
        if (reached && !kd_is_leaf(node)) {
            reached = kd_go_down(walk, node, along, hit.t);
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
                    ++walk.iterations;
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
                reference_end = walk.at.span.x <= hit.t ? second.y : second.x;
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
        done = done || walk.is_end;
        walk.is_beyond = walk.is_beyond || walk.at.span.x > hit.t;
#else
        // On to what is left, skipping what begins beyond the hit.
        bool leaves = !done && reference == reference_end && !ends_waiting;
        done = done || ends_waiting;
        if (leaves) {
            do {
                walk.is_beyond = false;
                kd_pop(walk, along, hit.t);
            } while (walk.is_beyond);
            if (walk.is_end) {
                ends_waiting = KD_POSTPONES && waits;
                done = !ends_waiting;
                reference = postponed.x;
                reference_end = ends_waiting ? postponed.y : postponed.x;
            }
            node = kd_node(walk.at.node);
        }
#endif
        // One leaf that is left is not worth stopping at; nor could flags say so of one at the lowest level, where they read as the end.
        bool one_leaf = KD_FLAGS ? walk.flags == INDEX_FINISHED
                                 : kd_is_leaf(node) && walk.top == 0u && walk.head.x == 0u && walk.bytes.x == 0u;
        // Neither does a ray stop while a leaf waits, or within one.
        stops = INDEX_QUOTA != INDEX_NEVER_STOPS && walk.iterations >= INDEX_QUOTA && !one_leaf && !waits && reference == reference_end;
    } while (!done && !stops);
    if (KD_STACK_STOPS && stops && !done) {
        walk.flags = kd_flags_of_stack(walk, root, along);
    }
    index_iterations += walk.iterations;
    if (INDEX_COUNT) {
        index_counters.iterations += walk.iterations;
    }
    return done ? INDEX_FINISHED : walk.flags;
}

#endif
