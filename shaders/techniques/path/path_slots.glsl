// What paths keep by slot beside their walks: the first surface that they see, where they were scattered last, and what photons have of their light.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_SLOTS_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_SLOTS_GLSL

#include "transport/light_receiver.glsl"

// descriptor set 1: PathSlotSet

struct PathAov {
    vec3 albedo;
    float depth;  // distance along the ray; 0 without a hit
    vec3 normal;
    uint filled;
};

layout(set = 1, binding = 0, scalar) restrict buffer PathAovs { PathAov path_aovs[]; };
// For which lights would have been chosen there; where that does not depend on the place, some other buffer is bound, and nothing may be read or
// written.
layout(set = 1, binding = 1, scalar) restrict buffer PathReceivers { LightReceiver path_receivers[]; };
// Cosine to the geometric normal under which a path left where it was scattered last, where edges are bounded by their geometry term; elsewhere as above.
layout(set = 1, binding = 2, scalar) restrict buffer PathDepartures { float path_departures[]; };
// Of paths that share light with photons: the squared distance of a light, m2, at which both have half (transport/photon_share.glsl). 0 before the first scattering in a medium;
// its negative between that and the next scattering, when only light samples are shared; positive after. Where nothing is shared, another buffer is bound.
layout(set = 1, binding = 3, scalar) restrict buffer PathEvenDistances { float path_even_distances[]; };

// What such paths keep besides where photons have planes.
struct PathFlight {
    // Of the directions before and after the first scattering in a medium: photons' planes have the light of the next one in its body. 0 once the path has left that.
    vec3 crossing;
    // 4 pi times the density of the last scattering, where it was a medium's; else 1.
    float evenness;
};
layout(set = 1, binding = 4, scalar) restrict buffer PathFlights { PathFlight path_flights[]; };

#endif
