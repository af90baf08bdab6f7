#version 460
// Queue compaction, first stage: how many paths of each chunk are alive, and how many have a shadow ray.
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
    uvec2 counts = uvec2(0u);
    for (uint place = range.x; place < range.y; ++place) {
        counts += flagged(place);
    }
    path_chunks[chunk] = counts;
}
