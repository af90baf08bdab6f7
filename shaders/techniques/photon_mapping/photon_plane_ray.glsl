// The ray that an eye path sends along a photon's second flight, back to where it began: whether it is free says whether the planes that the eye path meets count.
//
// Of all planes that an eye path's way meets one is chosen with the probability of its share of their light, and its ray stands for all of them: unbiased, since what is expected
// of the whole sum times the sight of one is the sum of each one's light times its own sight. The choice is by the least of exponential variates, one for each plane, whose rates are
// the planes' light: the same in whatever order they are met.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_PLANE_RAY_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_PLANE_RAY_GLSL

// Stand for where a traversal goes on: at its start, and nowhere (accel/index_rays.glsl).
const uint PLANE_RAY_BEGINS = 0u;
const uint PLANE_RAY_ENDED = 0xFFFFFFFFu;

// By place.
struct PlaneRay {
    vec3 origin;
    float reach;     // m
    vec3 direction;  // unit
    uint resume;     // where the traversal goes on
    vec3 color;      // radiance over `total` if nothing stands in between
    float total;     // light of all planes that were met, in the unit of their choice
    float variate;   // of the chosen plane
};

#endif
