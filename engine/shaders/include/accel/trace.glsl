// The trace kernels: TRACE, defined by the includer, is closest_hit or any_hit.
#ifndef CLERESTORY_ACCEL_TRACE_GLSL
#define CLERESTORY_ACCEL_TRACE_GLSL

#include "accel/trace_interface.glsl"
#include "accel/bvh2.glsl"

void main() {
    uint index = trace_constants.first_ray + gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= trace_constants.ray_count) {
        return;
    }
    uint resume = trace_resume[index];
    if (resume == BVH2_FINISHED) {
        return;
    }
    Ray ray = trace_rays[index];
    Hit hit = no_hit(ray.t_max);
    if (resume != BVH2_START) {
        hit = trace_hits[index];
    }
    resume = TRACE(ray, resume, hit);
    trace_hits[index] = hit;
    trace_resume[index] = resume;
    if (resume != BVH2_FINISHED) {
        atomicAdd(trace_status.unfinished, 1u);
    }
    if (BVH2_COUNT) {
        atomicAdd(trace_status.node_visits, bvh2_counters.x);
        atomicAdd(trace_status.triangle_tests, bvh2_counters.y);
        atomicAdd(trace_status.iterations, bvh2_counters.z);
    }
}

#endif
