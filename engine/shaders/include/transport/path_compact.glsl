// Compaction of the path queue, and of the shadow rays, in three stages: counts of chunks, a scan of the counts by one workgroup, scatter. Keeps the order, so
// the queues are the same on every run. Each invocation of the first and last stage walks COMPACT_CHUNK places.
#ifndef CLERESTORY_TRANSPORT_PATH_COMPACT_GLSL
#define CLERESTORY_TRANSPORT_PATH_COMPACT_GLSL

#include "transport/path_buffers.glsl"

// The places of a chunk that lie in a queue of `count`.
uvec2 chunk_range(uint chunk, uint count) {
    uint first = min(chunk * COMPACT_CHUNK, count);
    return uvec2(first, min(first + COMPACT_CHUNK, count));
}

// One each for a path that is alive, and for one with a shadow ray.
uvec2 flagged(uint place) {
    uint flags = texelFetch(path_flags_in, int(place)).x;
    return uvec2((flags & FLAG_ALIVE) != 0u, (flags & FLAG_SHADOW) != 0u);
}

uint chunks_for(uint count) { return (count + COMPACT_CHUNK - 1u) / COMPACT_CHUNK; }
uint groups_for(uint count) { return (count + PATH_GROUP - 1u) / PATH_GROUP; }

#endif
