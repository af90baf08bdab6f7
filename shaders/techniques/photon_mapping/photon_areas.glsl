// Sums of the kernels' areas in one order whatever the device: of an invocation's records, then of a workgroup's invocations, then of workgroups.
// Twin of clerestory::techniques::photon_mapping::map::sum_in_order.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_AREAS_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_AREAS_GLSL

#include "accel/lbvh.glsl"

shared uvec2 group_areas[LBVH_GROUP_SIZE];

// The sum of what the invocations of a workgroup give, in the first of them. Has barriers.
double sum_of_group(uint lane, double areas) {
    group_areas[lane] = unpackDouble2x32(areas);
    barrier();
    precise double sum = 0.0lf;
    for (uint i = 0u; lane == 0u && i < LBVH_GROUP_SIZE; ++i) {
        sum += packDouble2x32(group_areas[i]);
    }
    return sum;
}

#endif
