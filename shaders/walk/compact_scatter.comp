#version 460
// Queue compaction, third stage: the walks that are alive to the other queue, and the places where something waits to theirs, in order.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool REFILLED = false;  // slots take new walks as walks end

#include "walk/compact.glsl"
#include "walk/turnover.glsl"

// By slot SLOT_*, of a wave that is kept full; elsewhere some other buffer is bound, and nothing is written.
layout(set = 1, binding = 0, scalar) restrict writeonly buffer WalkTurnover { uint walk_turnover[]; };

void main() {
    uint chunk = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || chunk >= chunks_for(status.previous_count)) {
        return;
    }
    // The scan has counted this bounce already.
    bool first_bounce = status.rounds == 1u;
    uvec2 range = chunk_texels(chunk, status.previous_count);
    uvec2 target = walk_chunks[chunk];
    for (uint texel = range.x; texel < range.y; ++texel) {
        uvec4 flags = load_flags(texel, status.previous_count);
        for (uint i = 0u; i < FLAGS_PER_TEXEL; ++i) {
            uint place = FLAGS_PER_TEXEL * texel + i;
            bool alive = (flags[i] & FLAG_ALIVE) != 0u;
            if (REFILLED && place < status.previous_count) {
                uint slot = texelFetch(walk_queue_in, int(place)).x;
                if (!alive) {
                    walk_turnover[slot] = SLOT_ENDED;
                } else if (target.x == 0u) {
                    status.oldest = texelFetch(walk_numbers_in, int(slot)).w;
                }
            }
            if (alive) {
                walk_queue_out[target.x++] = first_bounce ? place : texelFetch(walk_queue_in, int(place)).x;
            }
            if ((flags[i] & FLAG_WAITING) != 0u) {
                walk_waiting_queue_out[target.y++] = place;
            }
        }
    }
}
