#version 460
// Queue compaction, second stage: one workgroup turns the chunks' counts into offsets, writes the arguments of the next round's
// dispatches and keeps the ray counters.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/compact.glsl"

// Lanes whose totals are summed before the sums are.
const uint SCAN_BLOCK = 8u;

shared uvec2 totals[WALK_GROUP];
shared uvec2 block_totals[WALK_GROUP / SCAN_BLOCK];

void add_64(inout uint low, inout uint high, uint amount) {
    uint carry;
    low = uaddCarry(low, amount, carry);
    high += carry;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    uint count = status.active_count;
    bool stalled = status.stalled != STALLED_NOT;
    uint chunks = stalled ? 0u : chunks_for(count);
    uint each = (chunks + WALK_GROUP - 1u) / WALK_GROUP;
    uint first = min(lane * each, chunks);
    uint last = min(first + each, chunks);
    uvec2 total = uvec2(0u);
    for (uint chunk = first; chunk < last; ++chunk) {
        total += walk_chunks[chunk];
    }
    totals[lane] = total;
    memoryBarrierBuffer();
    barrier();
    if (lane < WALK_GROUP / SCAN_BLOCK) {
        uvec2 sum = uvec2(0u);
        for (uint other = 0u; other < SCAN_BLOCK; ++other) {
            sum += totals[SCAN_BLOCK * lane + other];
        }
        block_totals[lane] = sum;
    }
    barrier();
    uvec2 before = uvec2(0u);
    for (uint block = 0u; block < lane / SCAN_BLOCK; ++block) {
        before += block_totals[block];
    }
    for (uint other = lane / SCAN_BLOCK * SCAN_BLOCK; other < lane; ++other) {
        before += totals[other];
    }
    uvec2 offset = before;
    for (uint chunk = first; chunk < last; ++chunk) {
        uvec2 counts = walk_chunks[chunk];
        walk_chunks[chunk] = offset;
        offset += counts;
    }
    if (lane == WALK_GROUP - 1u && stalled) {
        // What is recorded for later rounds has the queues in the wrong roles: it must find nothing to do. The host sets these again.
        status.item_groups[0] = 0u;
        status.chunk_groups[0] = 0u;
        status.scatter_groups[0] = 0u;
        status.waiting_groups[0] = 0u;
    }
    if (lane == WALK_GROUP - 1u && !stalled) {
        uvec2 all = before + total;
        status.scatter_groups[0] = status.chunk_groups[0];
        status.previous_count = count;
        status.active_count = all.x;
        status.waiting_count = all.y;
        status.waiting_groups[0] = groups_for(all.y);
        status.item_groups[0] = groups_for(all.x);
        status.chunk_groups[0] = groups_for(chunks_for(all.x));
        status.rounds += count > 0u ? 1u : 0u;
        add_64(status.rays[0], status.rays[1], count);
        add_64(status.waited[0], status.waited[1], all.y);
    }
}
