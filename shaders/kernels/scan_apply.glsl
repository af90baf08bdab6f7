// Third stage of a scan: each team scans its block after what lies before it.
#ifndef CLERESTORY_KERNELS_SCAN_APPLY_GLSL
#define CLERESTORY_KERNELS_SCAN_APPLY_GLSL

#include "kernels/scan.glsl"

// descriptor set 0: ScanApplySet

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;
// May be one buffer: every element is read before it is written, and by one invocation.
layout(set = 0, binding = 1, scalar) readonly buffer ScanIn { uint scan_in[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ScanStarts { uint scan_starts[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer ScanOut { uint scan_out[]; };

void scan_apply() {
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    uint team = scan_team_index();
    if (team >= stream_teams(count, block)) {
        return;
    }
    uvec2 range = stream_range(team, count, block);
    uvec2 before = uvec2(scratch[scan_part_at(team)], scratch[scan_part_at(team) + 1u]);
    for (uint tile = range.x; tile < range.y; tile += scan_team_lanes() * SCAN_ITEMS) {
        uint first = tile + scan_team_lane() * SCAN_ITEMS;
        uvec2 items[SCAN_ITEMS];
        uvec2 own = TEAM_IDENTITY;
        for (uint i = 0u; i < SCAN_ITEMS; ++i) {
            items[i] = TEAM_IDENTITY;
            if (first + i < range.y) {
                items[i] = uvec2(SEGMENTED ? scan_starts[first + i] : 0u, scan_in[first + i]);
            }
            own = scan_combine(own, items[i]);
        }
        uvec2 total;
        uvec2 running = scan_combine(before, scan_team(own, total));
        for (uint i = 0u; i < SCAN_ITEMS; ++i) {
            uvec2 after = scan_combine(running, items[i]);
            if (first + i < range.y) {
                scan_out[first + i] = INCLUSIVE ? after.y : items[i].x != 0u ? scan_identity() : running.y;
            }
            running = after;
        }
        before = scan_combine(before, total);
    }
}

#endif
