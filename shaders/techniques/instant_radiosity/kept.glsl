// Virtual lights that are kept from frame to frame: what is asked of each, and what its direction from the lamp meets.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_KEPT_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_KEPT_GLSL

const uint KEPT_STAYS = 0u;   // as it is
const uint KEPT_ASKED = 1u;   // whether the lamp sees it from where that is now
const uint KEPT_NEW = 2u;     // in a new direction
const uint KEPT_ABSENT = 3u;  // there is none

const uint KEPT_HIDDEN = 0u;
const uint KEPT_SEEN = 1u;
const uint KEPT_STOPPED = 2u;  // its ray has stopped at its quota

struct KeptLight {
    vec3 lamp;       // where its lamp is
    uint asks;
    vec3 direction;  // unit, from there
    vec3 power;      // W, of its share of the directions, as if it were the only light
};

struct KeptHit {
    vec3 position;
    uint triangle;   // NO_HIT where the direction leaves the scene
    vec2 weights;    // of the corners 1 and 2
    uint sight;
};

#endif
