#version 460
// The deposits of a bounce go to the end of the map's records, in the order of the queue.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;     // record of the wave's first deposit
    uint capacity;  // records
} push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.waiting_count) {
        return;
    }
    // The scan has counted this bounce already.
    uint record = push.first + (status.waited[0] - status.waiting_count) + place;
    if (record >= push.capacity) {
        return;
    }
    uint source = PHOTON_QUARTERS * texelFetch(walk_waiting_queue_in, int(place)).x;
    for (uint i = 0u; i < PHOTON_QUARTERS; ++i) {
        photon_records[PHOTON_QUARTERS * record + i] = texelFetch(walk_waiting_in, int(source + i));
    }
}
