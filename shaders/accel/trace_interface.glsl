// What the trace kernels share: rays in, hits out, and where stopped rays go on (set 0).
//
// The host zeroes `trace_resume` and `trace_status` and dispatches until `trace_status.unfinished` stays zero, zeroing
// `trace_status` in between; finished rays return at once. Larger ray counts than one dispatch takes go in parts by `first_ray`.
#ifndef CLERESTORY_ACCEL_TRACE_INTERFACE_GLSL
#define CLERESTORY_ACCEL_TRACE_INTERFACE_GLSL

#include "accel/ray.glsl"

layout(set = 0, binding = 0, scalar) restrict readonly buffer TraceRays {
    Ray trace_rays[];
};

layout(set = 0, binding = 1, scalar) restrict buffer TraceHits {
    Hit trace_hits[];
};

layout(set = 0, binding = 2, scalar) restrict buffer TraceResume {
    uint trace_resume[];
};

// Rays stopped by the quota, and traversal counters of two words, the low one first, when counting is specialised in.
layout(set = 0, binding = 3, scalar) restrict buffer TraceStatus {
    uint unfinished;
    uint node_visits[2];
    uint triangle_tests[2];
    uint iterations[2];
    uint kd_leaves[2];
    uint kd_pushes[2];
    uint kd_pops[2];
    uint kd_restarts[2];
    uint kd_cached_nodes[2];
    uint kd_register_pushes[2];
    uint kd_register_pops[2];
} trace_status;

layout(push_constant, scalar) uniform TraceConstants {
    uint first_ray;
    uint ray_count;
} trace_constants;

#endif
