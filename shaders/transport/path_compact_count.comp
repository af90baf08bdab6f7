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
    uvec2 range = chunk_texels(chunk, status.active_count);
    uvec4 alive = uvec4(0u);
    uvec4 shadows = uvec4(0u);
    for (uint texel = range.x; texel < range.y; ++texel) {
        uvec4 flags = load_flags(texel, status.active_count);
        alive += flagged(flags, FLAG_ALIVE);
        shadows += flagged(flags, FLAG_SHADOW);
    }
    path_chunks[chunk] = uvec2(alive.x + alive.y + alive.z + alive.w, shadows.x + shadows.y + shadows.z + shadows.w);
}
