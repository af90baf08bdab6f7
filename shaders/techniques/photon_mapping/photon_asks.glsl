// Which eye paths ask the photon map where they have arrived: one decision, for queries and for the queues of them.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_ASKS_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_ASKS_GLSL

#include "transport/features.glsl"
#include "techniques/photon_mapping/photon_eye.glsl"
#include "transport/arrival.glsl"

struct AskSettings {
    vec3 scene_lower;
    uint states;        // of a path whose diffuse surfaces ask, a bit each
    vec3 scene_upper;
    uint most_bounces;  // scatterings in all, with that at the point
};

// Whether the path at a place asks; where it has arrived, if so.
bool asks_map(AskSettings ask, WalkState path, uint place, out Arrival arrival) {
    Hit hit = load_hit(place);
    if ((ask.states >> asking_state(path) & 1u) == 0u || hit.triangle == NO_HIT) {
        return false;
    }
    if (COUNTS_BOUNCES && asking_bounce(path) + 1u > ask.most_bounces) {
        return false;
    }
    arrival = arrival_at(hit, path.direction, ask.scene_lower, ask.scene_upper);
    // Boundaries of media are no surfaces.
    bool passed = HAS_MEDIA && (arrival.material.flags & MATERIAL_BOUNDARY) != 0u;
    return !passed && !arrival_is_unlit(arrival) && arrival_has_diffuse_base(arrival);
}

#endif
