#version 460
// Queue compaction, first stage: how many walks of each chunk are alive, and at how many places something waits.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/compact.glsl"

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || chunk >= chunks_for(status.active_count)) {
        return;
    }
    uvec2 range = chunk_texels(chunk, status.active_count);
    uvec4 alive = uvec4(0u);
    uvec4 waiting = uvec4(0u);
    for (uint texel = range.x; texel < range.y; ++texel) {
        uvec4 flags = load_flags(texel, status.active_count);
        alive += flagged(flags, FLAG_ALIVE);
        waiting += flagged(flags, FLAG_WAITING);
    }
    walk_chunks[chunk] = uvec2(alive.x + alive.y + alive.z + alive.w, waiting.x + waiting.y + waiting.z + waiting.w);
}
