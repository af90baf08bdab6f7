#version 460
// Queue compaction, third stage: the paths that are alive, in order, to the other queue.
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
    uint target = chunk_counts[2u * chunk];
    for (uint place = range.x; place < range.y; ++place) {
        if ((flags[place] & FLAG_ALIVE) != 0u) {
            queue_out[target++] = queue_in[place];
        }
    }
}
