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
    if (b.spread > a.spread) {
        LightCone wide = b;
        b = a;
        a = wide;
    }
    float reach = max(a.reach, b.reach);
    vec3 pivot = cross(a.axis, b.axis);
    float sine = length(pivot);
    float cosine = dot(a.axis, b.axis);
    float angle = atan(sine, cosine);
    if (min(angle + b.spread, PI) <= a.spread) {
        return LightCone(a.axis, a.spread, reach);
    }
    float spread = 0.5 * (a.spread + angle + b.spread);
    if (spread >= PI || sine < LIGHT_CONE_PARALLEL) {
        // Axes that are equal but for rounding differ by less than any slack.
        return LightCone(a.axis, spread < PI && cosine > 0.0 ? a.spread : PI, reach);
    }
    float turn = spread - a.spread;
    vec3 across = cross(pivot / sine, a.axis);
    return LightCone(normalize(a.axis * cos(turn) + across * sin(turn)), spread, reach);
}

#endif
