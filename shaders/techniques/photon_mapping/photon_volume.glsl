// What the stages share that put events of photons in media behind each other: a bounce's deposits wait in one queue, of surfaces and of media, in the order of
// the walks. Flags by place of the queue say which they are, prefix sums of the flags how many of media come before, so that both kinds get to the ends of
// their own records in the order of the queue: the same order on every run.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_VOLUME_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_VOLUME_GLSL

#include "techniques/photon_mapping/photon_event.glsl"
#include "transport/differentials.glsl"
#include "walk/wave.glsl"

// descriptor set 1: PhotonVolumeSet

layout(constant_id = 55) const bool STORES_WAYS = false;  // ways of photons are stored, instead of their collisions or beside them
layout(constant_id = 56) const bool STORES_PLANES = false;  // and a plane of each way, in place of the beams of ways that begin at a collision
layout(constant_id = 57) const bool STORES_POINTS = false;  // and the collisions as well
// Other records beside the ways.
const bool STORES_BESIDE = STORES_PLANES || STORES_POINTS;

// A photon's way through a homogeneous medium, with what is left of its flux along it.
struct PhotonWay {
    vec3 start;
    float reach;
    vec3 direction;
    uint medium;
    vec3 flux;
    uint bounce;
    vec3 sigma_t;
    uint pieces;  // to be stored as so many beams
    float light2;  // as records have it
};


layout(set = 1, binding = 0, scalar) restrict buffer PhotonMediumCounters {
    uint absorbed;  // photons that a collision has ended
    uint events;    // records that were stored: collisions, pieces of ways, planes
} photon_medium_counters;
// Of the wave; its first stage of a bounce keeps it.
layout(set = 1, binding = 1, scalar) restrict buffer PhotonVolumeQueue {
    uint before;     // events of earlier bounces
    uint in_bounce;  // those of the last bounce that has been appended
    uint landed_before;     // the same of deposits on surfaces, where ways are stored
    uint landed_in_bounce;
} photon_volume_queue;
layout(set = 1, binding = 2, scalar) restrict buffer PhotonVolumeWaiting { uint waiting; } photon_volume_waiting;
layout(set = 1, binding = 3, scalar) restrict buffer PhotonVolumeFlags { uint photon_volume_flags[]; };  // by place of the waiting queue
layout(set = 1, binding = 4, scalar) restrict readonly buffer PhotonVolumeRanks { uint photon_volume_ranks[]; };
layout(set = 1, binding = 5, scalar) restrict writeonly buffer PhotonVolumeRecords { uvec4 photon_volume_records[]; };
// Where ways are stored: flags and ranks of surfaces, and the way that waits at a place; elsewhere some other buffer is bound, and nothing is read or written.
layout(set = 1, binding = 7, scalar) restrict buffer PhotonLandedFlags { uint photon_landed_flags[]; };
layout(set = 1, binding = 8, scalar) restrict readonly buffer PhotonLandedRanks { uint photon_landed_ranks[]; };
layout(set = 1, binding = 9, scalar) restrict buffer PhotonWays { PhotonWay photon_ways[]; };
layout(set = 1, binding = 6, scalar) restrict buffer PhotonMediumDifferentials { Differentials photon_medium_differentials[]; };  // by slot
// Where other records are stored beside ways: the quarters of the one that waits at a place; elsewhere as above.
layout(set = 1, binding = 10, scalar) restrict buffer PhotonBeside { uvec4 photon_beside[]; };

// Of a record.
uint volume_quarters() { return STORES_BESIDE ? WIDE_QUARTERS : EVENT_QUARTERS; }

#endif
