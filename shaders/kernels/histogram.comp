#version 460
// How often each value below a bound occurs, and how many are not below it: counts of each workgroup in shared memory, then integer atomics.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;
// Bins, and one for all other values.
layout(constant_id = 1) const uint COUNTERS = 257u;

#include "kernels/stream_scratch.glsl"

layout(push_constant, scalar) uniform Push {
    StreamPlan plan;
    uint shift;  // of a value's lowest bit in its word
    uint mask;   // of a value, at bit 0
} push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer HistogramWords { uint histogram_words[]; };
// One word per bin, and one for all other values.
layout(set = 0, binding = 2, scalar) restrict buffer HistogramCounts { uint histogram_counts[]; };

shared uint counts[COUNTERS];

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint count = stream_size(push.plan);
    uvec2 range = stream_range(gl_WorkGroupID.x, count, stream_block(count, push.plan.tile, push.plan.max_teams));
    for (uint bin = lane; bin < COUNTERS; bin += gl_WorkGroupSize.x) {
        counts[bin] = 0u;
    }
    barrier();
    for (uint at = range.x + lane; at < range.y; at += gl_WorkGroupSize.x) {
        atomicAdd(counts[min((histogram_words[at] >> push.shift) & push.mask, COUNTERS - 1u)], 1u);
    }
    barrier();
    for (uint bin = lane; bin < COUNTERS; bin += gl_WorkGroupSize.x) {
        if (counts[bin] != 0u) {
            atomicAdd(histogram_counts[bin], counts[bin]);
        }
    }
}
