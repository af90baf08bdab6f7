// Last stage of compaction and split: each team moves the elements of its block to where the scan of the flags says.
//
// Compaction: flagged elements to the front, the others nowhere. Split (Blelloch, Prefix sums and their applications, 1990, section 1.3.1):
// those without flag to the front, the flagged ones behind them. Both keep the order.
#ifndef CLERESTORY_KERNELS_PARTITION_GLSL
#define CLERESTORY_KERNELS_PARTITION_GLSL

#include "kernels/scan.glsl"

// descriptor set 0: PartitionSet

layout(constant_id = 6) const bool SPLIT = false;
// Elements are their own numbers in the stream instead of words of a buffer.
layout(constant_id = 7) const bool NUMBERS = false;

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer PartitionFlags { uint partition_flags[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer PartitionIn { uint partition_in[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer PartitionOut { uint partition_out[]; };
// How many elements are flagged.
layout(set = 0, binding = 4, scalar) restrict writeonly buffer PartitionCount { uint partition_count[]; };

void partition_blocks() {
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    uint team = scan_team_index();
    uint flagged = scratch[scan_total_at() + 1u];
    if (team == 0u && scan_team_lane() == 0u) {
        partition_count[0] = flagged;
    }
    if (team >= stream_teams(count, block)) {
        return;
    }
    uvec2 range = stream_range(team, count, block);
    uint before = scratch[scan_part_at(team) + 1u];
    for (uint tile = range.x; tile < range.y; tile += scan_team_lanes() * SCAN_ITEMS) {
        uint first = tile + scan_team_lane() * SCAN_ITEMS;
        uint flags[SCAN_ITEMS];
        uint own = 0u;
        for (uint i = 0u; i < SCAN_ITEMS; ++i) {
            flags[i] = first + i < range.y ? min(partition_flags[first + i], 1u) : 0u;
            own += flags[i];
        }
        uvec2 total;
        uint place = before + scan_team(uvec2(0u, own), total).y;
        for (uint i = 0u; i < SCAN_ITEMS; ++i) {
            uint at = first + i;
            if (at < range.y && (SPLIT || flags[i] != 0u)) {
                uint target = !SPLIT ? place : flags[i] != 0u ? count - flagged + place : at - place;
                partition_out[target] = NUMBERS ? at : partition_in[at];
            }
            place += flags[i];
        }
        before += total.y;
    }
}

#endif
