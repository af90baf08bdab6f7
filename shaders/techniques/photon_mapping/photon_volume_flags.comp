#version 460
// How many records in media each of the deposits that wait is, for prefix sums of them (photon_volume.glsl).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_volume.glsl"

void main() {
    uint waiting = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || waiting >= status.waiting_count) {
        return;
    }
    uint place = texelFetch(walk_waiting_queue_in, int(waiting)).x;
    uint flags = texelFetch(walk_flags_in, int(place / FLAGS_PER_TEXEL))[place % FLAGS_PER_TEXEL];
    bool in_medium = (flags & FLAG_VOLUME) != 0u;
    uint records = in_medium ? (STORES_WAYS ? photon_ways[place].pieces : 1u) : 0u;
    if (STORES_BESIDE) {
        records += (flags & FLAG_BESIDE) != 0u ? 1u : 0u;
    }
    photon_volume_flags[waiting] = records;
    if (STORES_WAYS) {
        photon_landed_flags[waiting] = (flags & FLAG_LANDED) != 0u ? 1u : 0u;
    }
    if (waiting == 0u) {
        photon_volume_waiting.waiting = status.waiting_count;
        photon_volume_queue.before += photon_volume_queue.in_bounce;
        photon_volume_queue.in_bounce = 0u;
        if (STORES_WAYS) {
            photon_volume_queue.landed_before += photon_volume_queue.landed_in_bounce;
            photon_volume_queue.landed_in_bounce = 0u;
        }
    }
}
