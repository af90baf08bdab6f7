// Compaction of the queue of walks, and of the places where something waits, in three stages: counts of chunks, a scan of the counts by one
// workgroup, scatter. Keeps the order, so the queues are the same on every run. Each invocation of the first and last stage walks COMPACT_CHUNK places, four at a time.
#ifndef CLERESTORY_WALK_COMPACT_GLSL
#define CLERESTORY_WALK_COMPACT_GLSL

#include "walk/wave.glsl"

// The texels of the flags of a chunk.
uvec2 chunk_texels(uint chunk, uint count) {
    uint first = chunk * (COMPACT_CHUNK / FLAGS_PER_TEXEL);
    return uvec2(first, min(first + COMPACT_CHUNK / FLAGS_PER_TEXEL, (count + FLAGS_PER_TEXEL - 1u) / FLAGS_PER_TEXEL));
}

// Flags of the four places of a texel; none past the end of the queue.
uvec4 load_flags(uint texel, uint count) {
    uvec4 places = FLAGS_PER_TEXEL * texel + uvec4(0u, 1u, 2u, 3u);
    return mix(uvec4(0u), texelFetch(walk_flags_in, int(texel)), lessThan(places, uvec4(count)));
}

uvec4 flagged(uvec4 flags, uint flag) { return mix(uvec4(0u), uvec4(1u), notEqual(flags & flag, uvec4(0u))); }

uint chunks_for(uint count) { return (count + COMPACT_CHUNK - 1u) / COMPACT_CHUNK; }
uint groups_for(uint count) { return (count + WALK_GROUP - 1u) / WALK_GROUP; }

#endif
