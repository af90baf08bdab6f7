// Emitters that reflective shadow maps are drawn from, and the texels of their maps.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RSM_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RSM_GLSL

#include "techniques/instant_radiosity/seen.glsl"
#include "transport/lights.glsl"

const uint RSM_POINT = 0u;    // the same in all directions
const uint RSM_SPOT = 1u;     // within a cone
const uint RSM_DISTANT = 2u;  // parallel light
const uint RSM_SURFACE = 3u;  // a point of a surface that emits by Lambert's law

// How the points of a frame's lights lie in the unit square.
const uint RSM_HALTON = 0u;      // bases 2 and 3
const uint RSM_HAMMERSLEY = 1u;  // the number over those of its subset, and base 2
const uint RSM_RANDOM = 2u;      // independent

// A light, or a primary virtual light in place of one that has an area or surrounds the scene.
struct RsmEmitter {
    vec3 position;   // not of parallel light
    uint kind;
    vec3 direction;  // axis, normal, or way of parallel light
    float cos_outer;
    vec3 strength;   // W/sr along the axis or normal; of parallel light W/m2
    float cos_inner;
};

// A square picture of what an emitter lights.
struct RsmView {
    SeenFrom seen;
    uint emitter;
};

// What a texel's light meets.
struct RsmTexel {
    uint triangle;
    vec2 weights;  // of its corners 1 and 2
    vec3 power;    // W, that arrives; 0 where nothing does
};

// Radiant intensity along a unit direction, W/sr; of parallel light irradiance, W/m2.
vec3 rsm_intensity(RsmEmitter e, vec3 direction) {
    float along = dot(direction, e.direction);
    float share = e.kind == RSM_SPOT ? spot_falloff(along, e.cos_inner, e.cos_outer) : e.kind == RSM_SURFACE ? max(along, 0.0) : 1.0;
    return e.strength * share;
}

// Unit direction in which an emitter's light comes to a place.
vec3 rsm_direction(RsmEmitter e, vec3 position) { return e.kind == RSM_DISTANT ? e.direction : normalize(position - e.position); }

#endif
