// Invocations fetch tickets from one counter, each by itself or a subgroup at once, as persistent threads fetch rays.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require

layout(local_size_x = 64) in;

layout(constant_id = 0) const bool BY_SUBGROUP = false;

layout(set = 0, binding = 0, scalar) restrict buffer ModelCounter { uint model_counter; };
// Of each invocation, all of its tickets joined by exclusive or.
layout(set = 0, binding = 1, scalar) restrict writeonly buffer ModelTickets { uint model_tickets[]; };

layout(push_constant, scalar) uniform ModelQueuePush { uint fetches; } push;

void main() {
    uint joined = 0u;
    for (uint i = 0u; i < push.fetches; ++i) {
        uint ticket = 0u;
        if (BY_SUBGROUP) {
            // Workgroups may be smaller than a subgroup.
            uvec4 lanes = subgroupBallot(true);
            uint first = 0u;
            if (subgroupElect()) {
                first = atomicAdd(model_counter, subgroupBallotBitCount(lanes));
            }
            ticket = subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(lanes);
        } else {
            ticket = atomicAdd(model_counter, 1u);
        }
        joined ^= ticket;
    }
    model_tickets[gl_GlobalInvocationID.x] = joined;
}
