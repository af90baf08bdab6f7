// Closest-hit and any-hit traversal of the binary hierarchy; twin of clerestory::accel::bvh2::Traversal, which explains the order, the
// conservative boxes and how a stopped ray goes on.
//
// One loop, in which an iteration visits an inner node or tests one triangle, so that its iterations are all that a driver's cap on loops counts.
// With a filter of candidates a second one stands around it, and a subgroup may run as many iterations as its lanes have in sum: the quota
// must be that much smaller.
// A ray that its quota stops returns the word of the node to go on with; call again with it and the same hit. The quota must exceed
// BVH2_MAX_DEPTH; leaves on the stack may add (BVH2_MAX_DEPTH + 1) × leaf size iterations to it.
//
// With CLERESTORY_CANDIDATE_FILTER defined, as a constant that says whether there is a filter, the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
#ifndef CLERESTORY_ACCEL_BVH2_GLSL
#define CLERESTORY_ACCEL_BVH2_GLSL

#include "accel/box_test.glsl"
#include "accel/bvh2_layout.glsl"
#include "accel/triangle.glsl"
#include "accel/index_bindings.glsl"

const uint BVH2_MAX_DEPTH = 32u;

// Not at the end, and not stopped; a leaf that was begun is ended.
#define BVH2_UNFINISHED (word != INDEX_FINISHED && (iterations < INDEX_QUOTA || (word & BVH2_COUNT_MASK) != 0u))

#ifdef CLERESTORY_CANDIDATE_FILTER
// The filter is asked outside the loop, where lanes wait for each other with their candidates: inside, where subgroups run both sides of
// branches, every iteration would pay for it.
#define BVH2_BEGIN_CANDIDATES \
    bool awaiting; \
    Hit awaited; \
    do { \
        awaiting = false;
#define BVH2_GOES_ON !(CLERESTORY_CANDIDATE_FILTER && awaiting) && BVH2_UNFINISHED
#define BVH2_END_CANDIDATES \
        if (CLERESTORY_CANDIDATE_FILTER && awaiting && accept_candidate(awaited.triangle, awaited.barycentrics)) { \
            hit = awaited; \
            word = any_hit ? INDEX_FINISHED : word; \
        } \
    } while (CLERESTORY_CANDIDATE_FILTER && BVH2_UNFINISHED);
#else
#define BVH2_BEGIN_CANDIDATES
#define BVH2_GOES_ON BVH2_UNFINISHED
#define BVH2_END_CANDIDATES
#endif

// Traverses from `resume` on (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns INDEX_FINISHED or where to go on.
uint bvh2_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    if (resume == INDEX_FINISHED || !is_traceable(ray)) {
        return INDEX_FINISHED;
    }
    RayShear shear = ray_shear(ray.origin, ray.direction);
    vec4 root0 = uintBitsToFloat(index_texel(0));
    vec4 root1 = uintBitsToFloat(index_texel(1));
    vec4 root2 = uintBitsToFloat(index_texel(2));
    uint triangles = index_texel(3).w;
    vec3 root_lower = min(root0.xyz, vec3(root1.zw, root2.x));
    vec3 root_upper = max(vec3(root0.w, root1.xy), root2.yzw);
    BoxTest boxes = box_test(root_lower, root_upper, ray);

    // Turns from the root to the node to go on with, the first in the lowest bit.
    uint trail = 0u;
    uint replay = 0u;
    for (uint node = INDEX_RESUMES ? resume >> BVH2_COUNT_BITS : 0u; node != 0u; ++replay) {
        uint parent = index_texel(BVH2_NODE_QUARTERS * node + 3u).z;
        trail = trail << 1 | (parent & 1u);
        node = parent >> 1;
    }

    uint stack[BVH2_MAX_DEPTH + 1u];
    uint top = 0u;
    uint word = INDEX_START;
    uint iterations = 0u;
    BVH2_BEGIN_CANDIDATES
    do {
        ++iterations;
        bool pop = true;
        bool is_node = (word & BVH2_COUNT_MASK) == 0u;
        uint place = word >> BVH2_COUNT_BITS;
        uint quarter = is_node ? BVH2_NODE_QUARTERS * place : triangles + BVH2_TRIANGLE_QUARTERS * place;
        // Loaded before the branch, from one address for both kinds.
        vec4 q0 = uintBitsToFloat(index_texel(quarter));
        vec4 q1 = uintBitsToFloat(index_texel(quarter + 1u));
        uvec4 q2 = index_texel(quarter + 2u);
        vec4 q2_float = uintBitsToFloat(q2);
        if (is_node) {
            uvec2 children = index_texel(quarter + 3u).xy;
            vec2 span0 = box_span(boxes, q0.xyz, vec3(q0.w, q1.xy));
            vec2 span1 = box_span(boxes, vec3(q1.zw, q2_float.x), q2_float.yzw);
            vec2 enter = max(vec2(span0.x, span1.x), vec2(ray.t_min));
            vec2 leave = min(vec2(span0.y, span1.y), vec2(hit.t));
            uint first = enter.y < enter.x ? 1u : 0u;
            bvec2 hits = lessThanEqual(enter, leave);
            bool passed = INDEX_RESUMES && replay > 0u && (trail & 1u) != first;
            bool visit_first = (first == 0u ? hits.x : hits.y) && !passed;
            bool visit_second = first == 0u ? hits.y : hits.x;
            uint next = visit_first ? first : 1u - first;
            if (INDEX_RESUMES) {
                replay = replay > 0u && next == (trail & 1u) ? replay - 1u : 0u;
                trail >>= 1;
            }
            if (visit_first && visit_second) {
                stack[top++] = first == 0u ? children.y : children.x;
            }
            pop = !(visit_first || visit_second);
            if (INDEX_RESUMES) {
                replay = pop ? 0u : replay;
            }
            word = next == 0u ? children.x : children.y;
            INDEX_COUNT_ONE(nodes)
        } else {
            TriangleHit candidate;
            bool better = intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, q2_float.x), ray.t_min, hit.t, candidate);
            pop = (word & BVH2_COUNT_MASK) == 1u;
            word += BVH2_COUNT_MASK;
            if (better) {
                uint triangle = q2.y;
                better = candidate.t < hit.t || triangle < hit.triangle;
                if (better) {
                    Hit found = Hit(candidate.t, candidate.barycentrics, triangle);
#ifdef CLERESTORY_CANDIDATE_FILTER
                    if (CLERESTORY_CANDIDATE_FILTER) {
                        awaiting = true;
                        awaited = found;
                    } else
#endif
                    {
                        hit = found;
                        top = any_hit ? 0u : top;
                        pop = pop || any_hit;
                    }
                }
            }
            INDEX_COUNT_ONE(triangles)
        }
        if (pop) {
            word = top > 0u ? stack[--top] : INDEX_FINISHED;
        }
    } while (BVH2_GOES_ON);
    BVH2_END_CANDIDATES
    index_iterations += iterations;
    if (INDEX_COUNT) {
        index_counters.iterations += iterations;
    }
    return word;
}

#endif
