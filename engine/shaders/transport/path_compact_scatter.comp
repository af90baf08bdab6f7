#version 460
// Queue compaction, third stage: the paths that are alive to the other queue, and the places with shadow rays to theirs, in order.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/path_compact.glsl"

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || chunk >= chunks_for(status.previous_count)) {
        return;
    }
    uvec2 range = chunk_range(chunk, status.previous_count);
    // The scan has counted this bounce already.
    bool first_bounce = status.rounds == 1u;
    uvec2 target = path_chunks[chunk];
    for (uint place = range.x; place < range.y; ++place) {
        uvec2 one = flagged(place);
        if (one.x != 0u) {
            path_queue_out[target.x] = first_bounce ? place : texelFetch(path_queue_in, int(place)).x;
        }
        if (one.y != 0u) {
            path_shadow_queue_out[target.y] = place;
        }
        target += one;
    }
}
