// Which places a queue of queries is for: those whose paths ask the photon map where they have arrived, or those whose rays ask the volume map on their way.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUE_ASKS_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_QUEUE_ASKS_GLSL

#include "techniques/photon_mapping/photon_asks.glsl"

layout(constant_id = 59) const bool OF_RAYS = false;  // as photon_beam_ways.comp has found out

bool asks_at(AskSettings ask, uint place) {
    if (OF_RAYS) {
        return walk_resume[place] == BEAM_ASKS;
    }
    Arrival arrival;
    return asks_map(ask, load_walk(load_slot(place)), place, arrival);
}

#endif
