// The trace kernel of workgroups that stay. What entry files define KD_CACHES and KD_VOTES for stands in kd.glsl.
#ifndef CLERESTORY_ACCEL_TRACE_QUEUE_GLSL
#define CLERESTORY_ACCEL_TRACE_QUEUE_GLSL

#include "accel/trace_ray.glsl"

// Batches that a workgroup fetches in one dispatch; 0 sets no end. Software drivers end loops silently after so many iterations of all
// loops of an invocation together: the quotas of batches and of rays must stay below it, or rays are lost.
layout(constant_id = 1) const uint TRACE_FETCHES = 64u;
// Rays of a batch.
layout(constant_id = 2) const uint TRACE_BATCH = 64u;

// The host zeroes it before the first of the dispatches that share the rays.
layout(set = 0, binding = 4, scalar) restrict buffer TraceQueue {
    // First ray that nobody has fetched, or beyond the last.
    uint next_ray;
    // Fetches that found rays, and the rays that they found, when counting is specialised in.
    uint batches;
    uint fetched_rays;
} trace_queue;

shared uint fetched;

void main() {
    uint unfinished = 0u;
    uint end = trace_constants.first_ray + trace_constants.ray_count;
    uint fetches = 0u;
    bool more = true;
    if (INDEX_KIND == INDEX_KD && KD_CACHE_LEVELS > 0u) {
        kd_load_cache();
    }
    while (more) {
        if (gl_LocalInvocationIndex == 0u) {
            fetched = trace_constants.first_ray + atomicAdd(trace_queue.next_ray, TRACE_BATCH);
        }
        barrier();
        uint first = fetched;
        // Read by all before the next is fetched.
        barrier();
        uint batch_end = min(first + TRACE_BATCH, end);
        if (INDEX_COUNT && gl_LocalInvocationIndex == 0u && first < end) {
            atomicAdd(trace_queue.batches, 1u);
            atomicAdd(trace_queue.fetched_rays, batch_end - first);
        }
        for (uint index = first + gl_LocalInvocationIndex; index < batch_end; index += gl_WorkGroupSize.x) {
            unfinished += trace_ray(index);
        }
        ++fetches;
        more = first < end && fetches != TRACE_FETCHES;
    }
    trace_account(unfinished);
}

#endif
