// What the kernels that measure queries on compact pairs share: queries in, work out.
#ifndef CLERESTORY_TESTS_COMPACT_QUERY_GLSL
#define CLERESTORY_TESTS_COMPACT_QUERY_GLSL

#include "accel/ray.glsl"

layout(local_size_x = 64) in;

// Work of a query; the leaves' first records enter `visits` in the order of their visits.
struct CompactWork {
    uint visits;
    uint leaves;
    uint nodes;
    uint pushes;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer CompactPairs { uvec4 compact_pairs[]; };
// Points are the origins of rays.
layout(set = 0, binding = 1, scalar) restrict readonly buffer CompactQueries { Ray compact_queries[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer CompactWorks { CompactWork compact_works[]; };
// Queries that the quota stopped.
layout(set = 0, binding = 3, scalar) restrict buffer CompactStatus { uint unfinished; } compact_status;

const uint COMPACT_VISIT_FACTOR = 0x9E3779B1u;

uint compact_visits = 0u;
uint compact_leaves = 0u;

uvec4 compact_quarter(uint index) { return compact_pairs[index]; }

bool compact_visit_point(uint first) {
    compact_visits = (compact_visits ^ first) * COMPACT_VISIT_FACTOR;
    ++compact_leaves;
    return false;
}

float compact_visit_ray(uint first, float t_max);

#include "accel/compact_bvh.glsl"

layout(push_constant, scalar) uniform CompactPush {
    CompactRoot root;
    uint count;
    // What a visited leaf draws the end of a ray to.
    float leaf_end;
} compact_push;

#ifdef COMPACT_RAY
float compact_visit_ray(uint first, float t_max) {
    compact_visit_point(first);
    return min(t_max, compact_push.leaf_end);
}
#endif

void compact_finish(uint query, bool finished) {
    compact_works[query] = CompactWork(compact_visits, compact_leaves, compact_counters.x, compact_counters.y);
    if (!finished) {
        atomicAdd(compact_status.unfinished, 1u);
    }
}

#endif
