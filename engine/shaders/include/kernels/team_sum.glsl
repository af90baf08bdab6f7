// The exclusive prefix sum over the invocations of a workgroup, with or without subgroup operations.
//
// Without: Hillis and Steele (Data parallel algorithms, 1986) in shared memory. With: the scan of each subgroup by the device, then of the
// subgroups' sums. A file that includes this defines LANES, the size of its workgroups, and
// KERNEL_SUBGROUPS for the second form. Sums are modulo 2^32. All invocations must call it; it begins and ends with what barriers it needs.
#ifndef CLERESTORY_KERNELS_TEAM_SUM_GLSL
#define CLERESTORY_KERNELS_TEAM_SUM_GLSL

shared uint team_sums[LANES];

#ifdef KERNEL_SUBGROUPS
uint team_exclusive_sum(uint value, out uint total) {
    uint before = subgroupExclusiveAdd(value);
    uint all = subgroupAdd(value);
    barrier();
    if (subgroupElect()) {
        team_sums[gl_SubgroupID] = all;
    }
    barrier();
    total = 0u;
    for (uint i = 0u; i < gl_NumSubgroups; ++i) {
        uint sum = team_sums[i];
        before += i < gl_SubgroupID ? sum : 0u;
        total += sum;
    }
    return before;
}
#else
uint team_exclusive_sum(uint value, out uint total) {
    uint lane = gl_LocalInvocationID.x;
    barrier();
    team_sums[lane] = value;
    barrier();
    uint sum = value;
    for (uint step = 1u; step < LANES; step *= 2u) {
        uint earlier = lane >= step ? team_sums[lane - step] : 0u;
        barrier();
        sum += earlier;
        team_sums[lane] = sum;
        barrier();
    }
    total = team_sums[LANES - 1u];
    return sum - value;
}
#endif

#endif
