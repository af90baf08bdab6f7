// One ray of the buffer: its closest hit, or, specialized so, any of its hits.
#ifndef CLERESTORY_ACCEL_TRACE_RAY_GLSL
#define CLERESTORY_ACCEL_TRACE_RAY_GLSL

#include "accel/trace_interface.glsl"
#include "accel/index.glsl"
#include "wide_counter.glsl"

layout(constant_id = 106) const bool TRACE_ANY = false;

// Begins a ray or goes on with it, unless it is finished. Returns 1 when its quota has stopped it, else 0.
uint trace_ray(uint index) {
    uint resume = trace_resume[index];
    if (resume == INDEX_FINISHED) {
        return 0u;
    }
    Ray ray = trace_rays[index];
    Hit hit = no_hit(ray.t_max);
    if (resume != INDEX_START) {
        hit = trace_hits[index];
    }
    if (TRACE_ANY) {
        resume = any_hit(ray, resume, hit);
    } else {
        resume = closest_hit(ray, resume, hit);
    }
    trace_hits[index] = hit;
    trace_resume[index] = resume;
    return resume == INDEX_FINISHED ? 0u : 1u;
}

// Adds what an invocation has done.
void trace_account(uint unfinished) {
    if (unfinished > 0u) {
        atomicAdd(trace_status.unfinished, unfinished);
    }
    if (INDEX_COUNT) {
        COUNT_WIDE(trace_status.node_visits, index_counters.nodes);
        COUNT_WIDE(trace_status.triangle_tests, index_counters.triangles);
        COUNT_WIDE(trace_status.iterations, index_counters.iterations);
        if (INDEX_KIND == INDEX_KD) {
            COUNT_WIDE(trace_status.kd_leaves, index_counters.leaves);
            COUNT_WIDE(trace_status.kd_pushes, index_counters.pushes);
            COUNT_WIDE(trace_status.kd_pops, index_counters.pops);
            COUNT_WIDE(trace_status.kd_restarts, index_counters.restarts);
            COUNT_WIDE(trace_status.kd_cached_nodes, index_counters.cached_nodes);
            COUNT_WIDE(trace_status.kd_register_pushes, index_counters.register_pushes);
            COUNT_WIDE(trace_status.kd_register_pops, index_counters.register_pops);
        }
    }
}

#endif
