#version 460
// Scan, second stage: one workgroup turns the teams' totals into what lies before each, and keeps the total of all.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/scan.glsl"

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;

uvec2 part(uint team) { return uvec2(scratch[scan_part_at(team)], scratch[scan_part_at(team) + 1u]); }

void main() {
    uint count = stream_size(push.plan);
    uint teams = stream_teams(count, stream_block(count, push.plan.tile, push.plan.max_teams));
    uint each = (teams + LANES - 1u) / LANES;
    uint first = min(gl_LocalInvocationID.x * each, teams);
    uint last = min(first + each, teams);
    uvec2 own = TEAM_IDENTITY;
    for (uint team = first; team < last; ++team) {
        own = scan_combine(own, part(team));
    }
    uvec2 total;
    uvec2 before = team_exclusive(own, total);
    for (uint team = first; team < last; ++team) {
        uvec2 after = scan_combine(before, part(team));
        scratch[scan_part_at(team)] = before.x;
        scratch[scan_part_at(team) + 1u] = before.y;
        before = after;
    }
    if (gl_LocalInvocationID.x == 0u) {
        scratch[scan_total_at()] = total.x;
        scratch[scan_total_at() + 1u] = total.y;
    }
}
