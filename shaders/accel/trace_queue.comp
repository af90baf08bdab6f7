// What rays of a buffer meet, by workgroups that stay: each fetches batches of rays from a counter until there are none, or until it
// has fetched TRACE_FETCHES batches. Twin in its hits and counters of trace_rays.comp; clerestory::accel::trace::RayTracer dispatches it.
//
// No workgroup waits for another. Best where a workgroup is one subgroup, so that no lane waits for other subgroups' rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#define KD_CACHES
#include "accel/trace_queue.glsl"
