// The scratch memory of a kernel over a stream: binding 0 of set 0.
#ifndef CLERESTORY_KERNELS_STREAM_SCRATCH_GLSL
#define CLERESTORY_KERNELS_STREAM_SCRATCH_GLSL

#include "kernels/stream.glsl"

layout(set = 0, binding = 0, scalar) restrict buffer StreamScratch {
    uint stream_groups[3];    // arguments of indirect dispatches
    uint stream_count;        // elements; 0 when there are more than the capacity
    uint stream_wanted;       // elements asked for
    uint stream_reserved[11];
    uint scratch[];
};

uint stream_size(StreamPlan plan) { return plan.count == STREAM_COUNT_ON_DEVICE ? stream_count : plan.count; }

#endif
