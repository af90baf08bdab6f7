// Scans of 32-bit words by sum, minimum or maximum, of the whole stream or of segments of it: what their stages share.
//
// Reduce, then scan: totals by team, their scan by one workgroup, scans of the blocks. Segments after Sengupta and others, Scan primitives
// for GPU computing (2007), section 3: pairs of a flag and a value, whose operation forgets what lies before a flag.
#ifndef CLERESTORY_KERNELS_SCAN_GLSL
#define CLERESTORY_KERNELS_SCAN_GLSL

#include "kernels/operation.glsl"
#include "kernels/stream_scratch.glsl"

// Invocations of a workgroup: the specialization constant 0.
#define LANES gl_WorkGroupSize.x
layout(constant_id = 1) const uint OPERATION = 0u;
// A team is one invocation.
layout(constant_id = 2) const bool SERIAL = false;
layout(constant_id = 3) const bool SEGMENTED = false;
layout(constant_id = 4) const bool INCLUSIVE = false;
// Elements count 1 where they are not 0.
layout(constant_id = 5) const bool FLAGS = false;

// Consecutive elements that a lane takes at once.
const uint SCAN_ITEMS = 4u;

uint scan_identity() { return OPERATION == OPERATION_MIN ? LARGEST_WORD : 0u; }

uint scan_operation(uint a, uint b) {
    return OPERATION == OPERATION_MIN ? min(a, b) : OPERATION == OPERATION_MAX ? max(a, b) : a + b;
}

// Flag and value of what lies in `earlier`, then in `later`.
uvec2 scan_combine(uvec2 earlier, uvec2 later) {
    return later.x != 0u ? later : uvec2(earlier.x, scan_operation(earlier.y, later.y));
}

// Words of the scratch memory: of all elements, and of a team's; the latter after the second stage those before the team's.
uint scan_total_at() { return 0u; }
uint scan_part_at(uint team) { return 2u + 2u * team; }

#define TEAM_TYPE uvec2
#define TEAM_IDENTITY uvec2(0u, scan_identity())
#define TEAM_COMBINE(earlier, later) scan_combine(earlier, later)
#include "kernels/team_scan.glsl"

uvec2 scan_team(uvec2 value, out uvec2 total) {
    if (SERIAL) {
        total = value;
        return TEAM_IDENTITY;
    }
    return team_exclusive(value, total);
}

uint scan_team_index() { return SERIAL ? gl_GlobalInvocationID.x : gl_WorkGroupID.x; }
uint scan_team_lane() { return SERIAL ? 0u : team_lane(); }
uint scan_team_lanes() { return SERIAL ? 1u : LANES; }

#endif
