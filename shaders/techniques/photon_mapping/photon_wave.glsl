// Working memory of photons under way, beside that of all walks (walk/wave.glsl): a photon is a walk from a light on, whose throughput is the
// light's power if it were the only photon. Its deposits wait by place through compaction, and are appended to the map's records in the order
// of the queue of what waits, bounce after bounce: the same order on every run.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_WAVE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_WAVE_GLSL

#include "techniques/photon_mapping/kernel.glsl"
#include "techniques/photon_mapping/photon_history.glsl"
#include "transport/differentials.glsl"
#include "walk/wave.glsl"

// descriptor set 3: PhotonWave

// What has become of photons.
layout(set = 3, binding = 0, scalar) restrict buffer PhotonCounters {
    uint escaped;         // left the scene
    uint absorbed;        // ended by roulette, or where nothing is scattered
    uint deposits;        // hits that were to be stored
    uint without_kernel;  // those that were not, since their footprint is degenerate
} photon_counters;
layout(set = 3, binding = 1, scalar) restrict buffer PhotonDifferentials { Differentials photon_differentials[]; };  // by slot
layout(set = 3, binding = 2, scalar) restrict writeonly buffer PhotonRecords { uvec4 photon_records[]; };
// Successors of each class of photons by lobe, as of states of path sets; where there are no classes some other buffer is bound, and nothing is read.
layout(set = 3, binding = 3, scalar) restrict readonly buffer PhotonClassSuccessors { uint photon_class_successors[]; };

#endif
