// The photon map as queries read it (descriptor set 1): compact sibling pairs, and records leaf by leaf.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_MAP_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_MAP_GLSL

#include "techniques/photon_mapping/kernel.glsl"
#include "techniques/photon_mapping/photon_history.glsl"

// descriptor set 1: PhotonMapSet

layout(set = 1, binding = 0) uniform utextureBuffer photon_pairs;
layout(set = 1, binding = 1) uniform utextureBuffer photon_map_records;

layout(set = 1, binding = 2, scalar) restrict buffer GatherCounters {
    uint queries;
    uint photons[2];  // kernels that held a point: 64 bits, the low word first
    uint stopped;     // queries that their quota stopped
} gather_counters;

uvec4 compact_quarter(uint index) { return texelFetch(photon_pairs, int(index)); }
uvec4 photon_quarter(uint record, uint quarter) { return texelFetch(photon_map_records, int(PHOTON_QUARTERS * record + quarter)); }

#endif
