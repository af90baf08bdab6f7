// What is known of each slot of a wave that is kept full. The compaction kernels take these words for flags of places: slots that are free become one list, and
// those whose walks have ended since the last turnover another, both ascending.
#ifndef CLERESTORY_WALK_TURNOVER_GLSL
#define CLERESTORY_WALK_TURNOVER_GLSL

#include "walk/wave.glsl"

const uint SLOT_TAKEN = 0u;
const uint SLOT_FREE = FLAG_ALIVE;
const uint SLOT_ENDED = FLAG_ALIVE | FLAG_WAITING;  // free, and what its walk has gathered is still to be taken

#endif
