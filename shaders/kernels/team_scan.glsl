// The exclusive scan over the invocations of a workgroup by any associative operation, with or without subgroup operations.
//
// Without: Hillis and Steele (Data parallel algorithms, 1986) in shared memory. With: the same within each subgroup by shuffles, then a
// walk over the subgroups' results, of any size of subgroups; the order is that of team_lane, since how invocations are dealt to subgroups is
// the device's choice. A file that includes this defines LANES, the size of its workgroups,
// TEAM_TYPE, TEAM_IDENTITY and TEAM_COMBINE(earlier, later), and KERNEL_SUBGROUPS for the second form. All invocations must call it; it has
// what barriers it needs, so shared memory that was written before a call can be read after it.
#ifndef CLERESTORY_KERNELS_TEAM_SCAN_GLSL
#define CLERESTORY_KERNELS_TEAM_SCAN_GLSL

shared TEAM_TYPE team_values[LANES];

#ifdef KERNEL_SUBGROUPS
// The place of this invocation in the scan.
uint team_lane() { return gl_SubgroupID * (LANES / gl_NumSubgroups) + gl_SubgroupInvocationID; }

TEAM_TYPE team_exclusive(TEAM_TYPE value, out TEAM_TYPE total) {
    // Subgroups are full: the host asks for that.
    uint width = LANES / gl_NumSubgroups;
    uint lane = gl_SubgroupInvocationID;
    TEAM_TYPE all = value;
    for (uint step = 1u; step < width; step *= 2u) {
        TEAM_TYPE earlier = subgroupShuffle(all, max(lane, step) - step);
        if (lane >= step) {
            all = TEAM_COMBINE(earlier, all);
        }
    }
    TEAM_TYPE before = subgroupShuffle(all, max(lane, 1u) - 1u);
    if (lane == 0u) {
        before = TEAM_IDENTITY;
    }
    barrier();
    if (lane == width - 1u) {
        team_values[gl_SubgroupID] = all;
    }
    barrier();
    TEAM_TYPE others = TEAM_IDENTITY;
    total = TEAM_IDENTITY;
    for (uint i = 0u; i < gl_NumSubgroups; ++i) {
        if (i == gl_SubgroupID) {
            others = total;
        }
        total = TEAM_COMBINE(total, team_values[i]);
    }
    return TEAM_COMBINE(others, before);
}
#else
// The place of this invocation in the scan.
uint team_lane() { return gl_LocalInvocationID.x; }

TEAM_TYPE team_exclusive(TEAM_TYPE value, out TEAM_TYPE total) {
    uint lane = team_lane();
    TEAM_TYPE all = value;
    barrier();
    team_values[lane] = all;
    barrier();
    for (uint step = 1u; step < LANES; step *= 2u) {
        TEAM_TYPE earlier = team_values[max(lane, step) - step];
        barrier();
        if (lane >= step) {
            all = TEAM_COMBINE(earlier, all);
            team_values[lane] = all;
        }
        barrier();
    }
    total = team_values[LANES - 1u];
    TEAM_TYPE before = team_values[max(lane, 1u) - 1u];
    if (lane == 0u) {
        before = TEAM_IDENTITY;
    }
    return before;
}
#endif

#endif
