// Which light paths a picture contains: a range of bounces, and an automaton that reads a path's lobes from the eye to the light.
//
// Layout and meaning: transport/path_set. One packed word holds bits 0-6 lobes, 7-18 least and 19-30 greatest number of bounces; a
// greatest number of PATH_SET_UNBOUNDED is no bound. A word per state holds seven successors of four bits, in the order of the LOBE_...
// bits; accepting states are the bits of one more word. A path carries its state beside its number of bounces.
#ifndef CLERESTORY_TRANSPORT_PATH_SET_GLSL
#define CLERESTORY_TRANSPORT_PATH_SET_GLSL

// Scattering in media, beside the LOBE_... bits of surfaces.
const uint LOBE_VOLUME = 64u;
const uint PATH_SET_LOBES = 127u;
const uint PATH_SET_LOBE_COUNT = 7u;
const uint PATH_SET_UNBOUNDED = 0xfffu;
const uint PATH_SET_MIN_SHIFT = 7u;
const uint PATH_SET_MAX_SHIFT = 19u;

// States in which a path may still come to belong to the set; the one after them is for all others.
const uint PATH_SET_STATES = 15u;
const uint PATH_SET_DEAD = 15u;
const uint PATH_SET_LIVE = 0x7fffu;
const uint PATH_SET_STATE_BITS = 4u;
// Where a path's state lies in the word of its number of bounces.
const uint PATH_SET_STATE_SHIFT = 28u;

uint path_set_lobes(uint packed_set) { return packed_set & PATH_SET_LOBES; }
uint path_set_min(uint packed_set) { return (packed_set >> PATH_SET_MIN_SHIFT) & PATH_SET_UNBOUNDED; }
uint path_set_max(uint packed_set) { return (packed_set >> PATH_SET_MAX_SHIFT) & PATH_SET_UNBOUNDED; }

// Whether paths may have more than `bounce` bounces.
bool path_set_continues(uint packed_set, uint bounce) {
    uint greatest = path_set_max(packed_set);
    return greatest == PATH_SET_UNBOUNDED || bounce < greatest;
}

// Whether light that arrives after `bounce` scatterings counts.
bool path_set_contains(uint packed_set, uint bounce) {
    return bounce >= path_set_min(packed_set) && (bounce == 0u || path_set_continues(packed_set, bounce - 1u));
}

// Number of bounces and state in one word.
uint path_set_joined(uint bounce, uint state) { return bounce | state << PATH_SET_STATE_SHIFT; }
uint path_set_bounce(uint joined) { return joined & ((1u << PATH_SET_STATE_SHIFT) - 1u); }
uint path_set_state(uint joined) { return joined >> PATH_SET_STATE_SHIFT; }

// The state after scattering by one lobe.
uint path_set_successor(uint successors, uint lobe) {
    return (successors >> (PATH_SET_STATE_BITS * uint(findLSB(lobe)))) & PATH_SET_DEAD;
}

// The lobes that lead to one of `states`, a bit each.
uint path_set_lobes_to(uint successors, uint states) {
    uint lobes = 0u;
    for (uint i = 0u; i < PATH_SET_LOBE_COUNT; i++) {
        uint next = (successors >> (PATH_SET_STATE_BITS * i)) & PATH_SET_DEAD;
        lobes |= ((states >> next) & 1u) << i;
    }
    return lobes;
}

#endif
