// The queue of eye paths that ask a photon map, of surfaces or of media (descriptor set 3), of one of three types.
//
// QUEUE_SLOTS: an invocation per place of the wave; those that ask nothing idle. QUEUE_COMPACTED: flags by place and a stable compaction.
// QUEUE_BLOCKS: teams as wide as subgroups collect places in shared memory and append whole blocks of as many to a list. A block number is all that
// a consumer needs, so that consumers take the blocks of their own numbers instead of drawing tickets.
//
// PM-ST-2 to PM-ST-4: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §7.4.1. The order of blocks may differ from run to run, and which places a wave whose
// work is used up has left; each place's sum is its own.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUE_GLSL

// descriptor set 3: GatherQueue

layout(set = 3, binding = 0, scalar) restrict buffer GatherQueueHead {
    uint groups[3];   // indirect arguments of queries
    uint count;       // places, or blocks of them
    uint block_size;  // places of a block that is full
} gather_head;
layout(set = 3, binding = 1, scalar) restrict buffer GatherPlaces { uint gather_places[]; };
layout(set = 3, binding = 2, scalar) restrict buffer GatherFlags { uint gather_flags[]; };    // by place: whether it asks
layout(set = 3, binding = 3, scalar) restrict buffer GatherBlocks { uint gather_blocks[]; };  // places of each block
layout(set = 3, binding = 4, scalar) restrict buffer GatherFlagCount { uint gather_flag_count[]; };  // one word: places with a flag, 0 or 1

#include "techniques/photon_mapping/photon_queued_place.glsl"

#endif
