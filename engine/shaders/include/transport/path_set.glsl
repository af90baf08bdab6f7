// Which light paths a picture contains, in one word: bits 0-5 lobes, 6-17 least and 18-29 greatest number of bounces.
//
// Layout and meaning: transport/path_set.rs. A greatest number of PATH_SET_UNBOUNDED is no bound.
#ifndef CLERESTORY_TRANSPORT_PATH_SET_GLSL
#define CLERESTORY_TRANSPORT_PATH_SET_GLSL

// The class of scattering in media, beside the LOBE_... bits of surfaces.
const uint LOBE_VOLUME = 32u;
const uint PATH_SET_LOBES = 63u;
const uint PATH_SET_UNBOUNDED = 0xfffu;
const uint PATH_SET_MIN_SHIFT = 6u;
const uint PATH_SET_MAX_SHIFT = 18u;

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

#endif
