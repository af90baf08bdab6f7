#version 460
// Queue compaction, first stage: how many paths of each chunk are alive, and how many shadow rays it traced.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/path_compact.glsl"

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || chunk >= chunks_for(status.active_count)) {
        return;
    }
    uvec2 range = chunk_range(chunk, status.active_count);
    uint alive = 0u;
    uint shadows = 0u;
    for (uint place = range.x; place < range.y; ++place) {
        alive += flags[place] & FLAG_ALIVE;
        shadows += (flags[place] & FLAG_SHADOW) / FLAG_SHADOW;
    }
    chunk_counts[2u * chunk] = alive;
    chunk_counts[2u * chunk + 1u] = shadows;
}
