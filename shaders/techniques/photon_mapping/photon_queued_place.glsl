// Where queries find their places in a queue (photon_queue.glsl). The includer declares what it reads, gather_head, gather_places and gather_blocks.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUED_PLACE_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUED_PLACE_GLSL

const uint QUEUE_SLOTS = 0u;
const uint QUEUE_COMPACTED = 1u;
const uint QUEUE_BLOCKS = 2u;
// Blocks that a team collects before it appends them.
const uint QUEUE_BUFFER_BLOCKS = 7u;

const uint NO_PLACE = 0xFFFFFFFFu;

// The place of an invocation's query, or NO_PLACE.
uint queued_place(uint queue, uint index) {
    if (queue == QUEUE_COMPACTED) {
        return index < gather_head.count ? gather_places[index] : NO_PLACE;
    }
    uint size = gather_head.block_size;
    uint block = index / size;
    return block < gather_head.count && index % size < gather_blocks[block] ? gather_places[index] : NO_PLACE;
}

#endif
