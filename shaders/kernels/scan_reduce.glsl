// First stage of a scan: each team's total.
#ifndef CLERESTORY_KERNELS_SCAN_REDUCE_GLSL
#define CLERESTORY_KERNELS_SCAN_REDUCE_GLSL

#include "kernels/scan.glsl"

// descriptor set 0: ScanReduceSet

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer ScanFrom { uint scan_from[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer ScanHeads { uint scan_heads[]; };

void scan_reduce() {
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    uint team = scan_team_index();
    if (team >= stream_teams(count, block)) {
        return;
    }
    uvec2 range = stream_range(team, count, block);
    // Each lane a contiguous part of the block.
    uint lanes = scan_team_lanes();
    uint each = (range.y - range.x + lanes - 1u) / lanes;
    uint first = min(range.x + scan_team_lane() * each, range.y);
    uint last = min(first + each, range.y);
    uvec2 part = TEAM_IDENTITY;
    for (uint at = first; at < last; ++at) {
        uint value = scan_from[at];
        part = scan_combine(part, uvec2(SEGMENTED ? scan_heads[at] : 0u, FLAGS ? min(value, 1u) : value));
    }
    uvec2 total;
    scan_team(part, total);
    if (scan_team_lane() == 0u) {
        scratch[scan_part_at(team)] = total.x;
        scratch[scan_part_at(team) + 1u] = total.y;
    }
}

#endif
