#version 460
// The deposits of a bounce go to the ends of the maps' records, those of surfaces and those of media to their own, in the order of the queue.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_volume.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;           // record of the wave's first deposit on a surface
    uint capacity;        // records
    uint first_event;     // of its first one in a medium
    uint event_capacity;
} push;

void main() {
    uint waiting = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || waiting >= status.waiting_count) {
        return;
    }
    uint before = photon_volume_queue.before;
    uint rank = photon_volume_ranks[waiting];
    bool in_medium = photon_volume_flags[waiting] != 0u;
    if (waiting + 1u == status.waiting_count) {
        photon_volume_queue.in_bounce = rank + (in_medium ? 1u : 0u);
    }
    uint source = WAITING_QUARTERS * texelFetch(walk_waiting_queue_in, int(waiting)).x;
    if (in_medium) {
        uint event = push.first_event + before + rank;
        for (uint i = 0u; event < push.event_capacity && i < EVENT_QUARTERS; ++i) {
            photon_volume_records[EVENT_QUARTERS * event + i] = texelFetch(walk_waiting_in, int(source + i));
        }
        return;
    }
    // The scan has counted this bounce already.
    uint record = push.first + (status.waited[0] - status.waiting_count) - before + (waiting - rank);
    for (uint i = 0u; record < push.capacity && i < PHOTON_QUARTERS; ++i) {
        photon_records[PHOTON_QUARTERS * record + i] = texelFetch(walk_waiting_in, int(source + i));
    }
}
