// One ray of the buffer by TRACE, which the entry file defines as closest_hit or any_hit.
#ifndef CLERESTORY_ACCEL_TRACE_RAY_GLSL
#define CLERESTORY_ACCEL_TRACE_RAY_GLSL

#include "accel/trace_interface.glsl"
#include "accel/bvh2.glsl"

// Begins a ray or goes on with it, unless it is finished. Returns 1 when its quota has stopped it, else 0.
uint trace_ray(uint index) {
    uint resume = trace_resume[index];
    if (resume == BVH2_FINISHED) {
        return 0u;
    }
    Ray ray = trace_rays[index];
    Hit hit = no_hit(ray.t_max);
    if (resume != BVH2_START) {
        hit = trace_hits[index];
    }
    resume = TRACE(ray, resume, hit);
    trace_hits[index] = hit;
    trace_resume[index] = resume;
    return resume == BVH2_FINISHED ? 0u : 1u;
}

// Adds to a counter of two words: whoever carries the low word over adds the carry.
#define TRACE_ADD_WIDE(counter, more) \
    if (atomicAdd(counter[0], more) > 0xFFFFFFFFu - (more)) { \
        atomicAdd(counter[1], 1u); \
    }

// Adds what an invocation has done.
void trace_account(uint unfinished) {
    if (unfinished > 0u) {
        atomicAdd(trace_status.unfinished, unfinished);
    }
    if (BVH2_COUNT) {
        TRACE_ADD_WIDE(trace_status.node_visits, bvh2_counters.x);
        TRACE_ADD_WIDE(trace_status.triangle_tests, bvh2_counters.y);
        TRACE_ADD_WIDE(trace_status.iterations, bvh2_counters.z);
    }
}

#endif
