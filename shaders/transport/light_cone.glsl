// Cones of the normals of lights and of the directions around them. Source and meaning: transport/light_tree/cone.rs, whose twin this is.
#ifndef CLERESTORY_TRANSPORT_LIGHT_CONE_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_CONE_GLSL

#include "pi.glsl"

// Sine of the angle of two axes below which they count as equal or opposite. 2^-20.
const float LIGHT_CONE_PARALLEL = 9.5367432e-7;

struct LightCone {
    vec3 axis;     // unit
    float spread;  // greatest angle between the axis and a normal, in [0, pi]
    float reach;   // greatest angle between a normal and a direction that its light takes, in [0, pi]
};

// A cone that holds two others; the least one where neither axis is opposite to the other.
LightCone cone_union(LightCone a, LightCone b) {
    bool swaps = b.spread > a.spread;
    vec3 axis = swaps ? b.axis : a.axis;
    vec3 other = swaps ? a.axis : b.axis;
    float wide = max(a.spread, b.spread);
    float narrow = min(a.spread, b.spread);
    vec3 pivot = cross(axis, other);
    float sine = length(pivot);
    float cosine = dot(axis, other);
    float angle = atan(sine, cosine);
    bool holds = min(angle + narrow, PI) <= wide;
    float spread = 0.5 * (wide + angle + narrow);
    // Axes that are equal but for rounding differ by less than any slack.
    bool keeps = spread >= PI || sine < LIGHT_CONE_PARALLEL;
    float kept = spread < PI && cosine > 0.0 ? wide : PI;
    float turn = spread - wide;
    vec3 across = cross(pivot / max(sine, LIGHT_CONE_PARALLEL), axis);
    vec3 turned = normalize(axis * cos(turn) + across * sin(turn));
    return LightCone(holds || keeps ? axis : turned, holds ? wide : (keeps ? kept : spread), max(a.reach, b.reach));
}

#endif
