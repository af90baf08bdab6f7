#version 460
// Reads the number of elements of a stream from a buffer and writes the header of a kernel's scratch memory: the arguments of its indirect
// dispatches, and the count. More elements than the capacity become none, and the header says how many there were.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

#include "kernels/stream_scratch.glsl"

layout(set = 0, binding = 1, scalar) restrict readonly buffer StreamCounts { uint stream_counts[]; };

layout(push_constant, scalar) uniform Push {
    StreamPlan plan;
    uint capacity;
    uint teams_per_group;
} push;

void main() {
    uint wanted = stream_counts[0];
    uint count = wanted <= push.capacity ? wanted : 0u;
    uint teams = stream_teams(count, stream_block(count, push.plan.tile, push.plan.max_teams));
    // One at least: kernels write their results for no elements, too.
    stream_groups[0] = max((teams + push.teams_per_group - 1u) / push.teams_per_group, 1u);
    stream_groups[1] = 1u;
    stream_groups[2] = 1u;
    stream_count = count;
    stream_wanted = wanted;
}
