// Closest-hit and any-hit traversal of the binary hierarchy; twin of clerestory::accel::bvh2::Traversal, which explains the order, the
// conservative boxes and how a stopped ray goes on.
//
// One loop, in which an iteration visits an inner node or tests one triangle, so that its iterations are all that a driver's cap on loops counts.
// With a filter of candidates a second one stands around it, and a subgroup may run as many iterations as its lanes have in sum: the quota
// must be that much smaller.
// A ray that its quota stops returns the word of the node to go on with; call again with it and the same hit. The quota must exceed
// BVH2_MAX_DEPTH; leaves on the stack may add (BVH2_MAX_DEPTH + 1) × leaf size iterations to it.
//
// With CLERESTORY_CANDIDATE_FILTER defined the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
// and BVH2_RESUMES as a constant: false where every call begins at BVH2_START, which leaves the bookkeeping of resumption out.
#ifndef CLERESTORY_ACCEL_BVH2_GLSL
#define CLERESTORY_ACCEL_BVH2_GLSL

#include "accel/ray.glsl"
#include "accel/triangle.glsl"
#include "accel/bvh2_bindings.glsl"

#ifndef BVH2_RESUMES
#define BVH2_RESUMES true
#endif

layout(constant_id = 100) const uint BVH2_QUOTA = 32768u;
layout(constant_id = 101) const bool BVH2_COUNT = false;

const uint BVH2_MAX_DEPTH = 32u;
const uint BVH2_COUNT_BITS = 4u;
const uint BVH2_COUNT_MASK = (1u << BVH2_COUNT_BITS) - 1u;
const uint BVH2_NODE_QUARTERS = 4u;
const uint BVH2_TRIANGLE_QUARTERS = 3u;
const uint BVH2_START = 0u;
const uint BVH2_FINISHED = 0xFFFFFFFFu;
const float BVH2_BOX_SLACK = 1.0 / 262144.0;
const float BVH2_MIN_RELATIVE_COMPONENT = 8.6736174e-19;

// Not at the end, and not stopped; a leaf that was begun is ended.
#define BVH2_UNFINISHED (word != BVH2_FINISHED && (iterations < BVH2_QUOTA || (word & BVH2_COUNT_MASK) != 0u))

#ifdef CLERESTORY_CANDIDATE_FILTER
// The filter is asked outside of the loop, where lanes wait for each other with their candidates: inside, where subgroups run both sides of
// branches, every iteration would pay for it.
#define BVH2_BEGIN_CANDIDATES \
    bool awaiting; \
    Hit awaited; \
    do { \
        awaiting = false;
#define BVH2_GOES_ON !awaiting && BVH2_UNFINISHED
#define BVH2_END_CANDIDATES \
        if (awaiting && accept_candidate(awaited.triangle, awaited.barycentrics)) { \
            hit = awaited; \
            word = any_hit ? BVH2_FINISHED : word; \
        } \
    } while (BVH2_UNFINISHED);
#else
#define BVH2_BEGIN_CANDIDATES
#define BVH2_GOES_ON BVH2_UNFINISHED
#define BVH2_END_CANDIDATES
#endif

// Inner nodes visited, triangles tested, iterations; filled when BVH2_COUNT is set.
uvec3 bvh2_counters = uvec3(0u);

float bvh2_clamped_reciprocal(float d, float least) {
    return (d < 0.0 ? -1.0 : 1.0) / max(abs(d), least);
}

// Entry and exit distance of a box grown by the slack.
vec2 bvh2_span(vec3 lower, vec3 upper, vec3 origin, vec3 inverse, vec3 slack) {
    vec3 t0 = (lower - origin) * inverse;
    vec3 t1 = (upper - origin) * inverse;
    vec3 near = min(t0, t1) - slack;
    vec3 far = max(t0, t1) + slack;
    return vec2(max(near.x, max(near.y, near.z)), min(far.x, min(far.y, far.z)));
}

// Traverses from `resume` on (BVH2_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns BVH2_FINISHED or where to go on.
uint bvh2_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    if (resume == BVH2_FINISHED || !is_traceable(ray)) {
        return BVH2_FINISHED;
    }
    RayShear shear = ray_shear(ray.origin, ray.direction);
    float least = largest_component(abs(ray.direction)) * BVH2_MIN_RELATIVE_COMPONENT;
    vec3 inverse = vec3(bvh2_clamped_reciprocal(ray.direction.x, least), bvh2_clamped_reciprocal(ray.direction.y, least),
                        bvh2_clamped_reciprocal(ray.direction.z, least));
    vec4 root0 = uintBitsToFloat(bvh2_quarter(0));
    vec4 root1 = uintBitsToFloat(bvh2_quarter(1));
    vec4 root2 = uintBitsToFloat(bvh2_quarter(2));
    uint triangles = bvh2_quarter(3).w;
    vec3 root_lower = min(root0.xyz, vec3(root1.zw, root2.x));
    vec3 root_upper = max(vec3(root0.w, root1.xy), root2.yzw);
    float reach = largest_component(max(abs(root_lower - ray.origin), abs(root_upper - ray.origin)));
    vec3 slack = (BVH2_BOX_SLACK * reach) * abs(inverse);

    // Turns from the root to the node to go on with, the first in the lowest bit.
    uint trail = 0u;
    uint replay = 0u;
    for (uint node = BVH2_RESUMES ? resume >> BVH2_COUNT_BITS : 0u; node != 0u; ++replay) {
        uint parent = bvh2_quarter(BVH2_NODE_QUARTERS * node + 3u).z;
        trail = trail << 1 | (parent & 1u);
        node = parent >> 1;
    }

    uint stack[BVH2_MAX_DEPTH + 1u];
    uint top = 0u;
    uint word = BVH2_START;
    uint iterations = 0u;
    BVH2_BEGIN_CANDIDATES
    do {
        ++iterations;
        bool pop = true;
        bool is_node = (word & BVH2_COUNT_MASK) == 0u;
        uint place = word >> BVH2_COUNT_BITS;
        uint quarter = is_node ? BVH2_NODE_QUARTERS * place : triangles + BVH2_TRIANGLE_QUARTERS * place;
        // Loaded before the branch, from one address for both kinds.
        vec4 q0 = uintBitsToFloat(bvh2_quarter(quarter));
        vec4 q1 = uintBitsToFloat(bvh2_quarter(quarter + 1u));
        uvec4 q2 = bvh2_quarter(quarter + 2u);
        vec4 q2_float = uintBitsToFloat(q2);
        if (is_node) {
            uvec2 children = bvh2_quarter(quarter + 3u).xy;
            vec2 span0 = bvh2_span(q0.xyz, vec3(q0.w, q1.xy), ray.origin, inverse, slack);
            vec2 span1 = bvh2_span(vec3(q1.zw, q2_float.x), q2_float.yzw, ray.origin, inverse, slack);
            vec2 enter = max(vec2(span0.x, span1.x), vec2(ray.t_min));
            vec2 leave = min(vec2(span0.y, span1.y), vec2(hit.t));
            uint first = enter.y < enter.x ? 1u : 0u;
            bvec2 hits = lessThanEqual(enter, leave);
            bool passed = BVH2_RESUMES && replay > 0u && (trail & 1u) != first;
            bool visit_first = (first == 0u ? hits.x : hits.y) && !passed;
            bool visit_second = first == 0u ? hits.y : hits.x;
            uint next = visit_first ? first : 1u - first;
            if (BVH2_RESUMES) {
                replay = replay > 0u && next == (trail & 1u) ? replay - 1u : 0u;
                trail >>= 1;
            }
            if (visit_first && visit_second) {
                stack[top++] = first == 0u ? children.y : children.x;
            }
            pop = !(visit_first || visit_second);
            if (BVH2_RESUMES) {
                replay = pop ? 0u : replay;
            }
            word = next == 0u ? children.x : children.y;
            if (BVH2_COUNT) {
                ++bvh2_counters.x;
            }
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
                    awaiting = true;
                    awaited = found;
#else
                    hit = found;
                    top = any_hit ? 0u : top;
                    pop = pop || any_hit;
#endif
                }
            }
            if (BVH2_COUNT) {
                ++bvh2_counters.y;
            }
        }
        if (pop) {
            word = top > 0u ? stack[--top] : BVH2_FINISHED;
        }
    } while (BVH2_GOES_ON);
    BVH2_END_CANDIDATES
    if (BVH2_COUNT) {
        bvh2_counters.z += iterations;
    }
    return word;
}

// Candidate of least t, of equal ones that of least triangle index.
uint closest_hit(Ray ray, uint resume, inout Hit hit) {
    return bvh2_traverse(ray, resume, false, hit);
}

// Ends at the first candidate; occluded once the hit has a triangle, which may be any of those met.
uint any_hit(Ray ray, uint resume, inout Hit hit) {
    return bvh2_traverse(ray, resume, true, hit);
}

#endif
