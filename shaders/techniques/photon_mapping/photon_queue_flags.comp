#version 460
// The compacted queue of queries, first stage: which places ask a photon map. A stream compaction (kernels/partition) lists them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_queue.glsl"
#include "techniques/photon_mapping/photon_queue_asks.glsl"

layout(push_constant, scalar) uniform Push { AskSettings ask; } push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (!wave_has_arrived() || place >= status.active_count) {
        return;
    }
    gather_flags[place] = uint(asks_at(push.ask, place));
    if (place == 0u) {
        gather_flag_count[0] = status.active_count;
    }
}
