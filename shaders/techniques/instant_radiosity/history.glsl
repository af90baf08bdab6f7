// Light that is blended with that of the frame before: where a point was in the picture then, which pixels there stand for it, how far they are trusted, and how bright
// a pixel may be beside its neighbours. Twin of many_light/history.rs.
//
// SVO-G4: C. Sun, "Many-light real-time global illumination using sparse voxel octree", 2015, §2.2.4: the blend and what lowers the confidence. The forms are derived here.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_HISTORY_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_HISTORY_GLSL

#include "techniques/instant_radiosity/seen.glsl"

// The greatest change of luminance over what it was.
const float HISTORY_CHANGE_MAX = 1000.0;
// A place so close to the middle of a pixel, in pixels, is there: else rounding would blur what stands still.
const float HISTORY_SNAP = 1.0 / 128.0;
// Confidence of a pixel that later frames find nothing at.
const float HISTORY_NONE = -1.0;

// What a frame leaves of a pixel.
struct HistoryPixel {
    vec3 light;        // over the surface's colour; negative in bands of which that has none
    float confidence;  // share of it that was there before
    vec3 position;
    uint normal;       // shading normal
    uint object;
};

// Where a point is in a picture, in pixels from its upper left corner; false for one behind the camera.
bool history_place(SeenFrom from, vec3 point, out vec2 place) {
    vec3 way = point - from.origin;
    vec3 across = cross(from.right, from.down);
    float volume = dot(across, from.forward);
    float depth = dot(across, way);
    vec2 sides = vec2(dot(cross(from.down, from.forward), way), dot(cross(from.forward, from.right), way));
    sides /= from.is_parallel != 0u ? volume : depth;
    place = 0.5 * (sides + 1.0) * vec2(from.width, from.height);
    return depth * volume > 0.0;
}

// Weights of the four pixels about a place: from the upper left one on, by rows.
vec4 history_weights(vec2 place, out ivec2 first) {
    vec2 from_middle = place - 0.5;
    vec2 lower = floor(from_middle);
    vec2 within = from_middle - lower;
    bvec2 is_next = greaterThan(within, vec2(1.0 - HISTORY_SNAP));
    first = ivec2(lower) + ivec2(is_next);
    vec2 x = mix(within, vec2(0.0), lessThan(min(within, 1.0 - within), vec2(HISTORY_SNAP)));
    return vec4((1.0 - x.x) * (1.0 - x.y), x.x * (1.0 - x.y), (1.0 - x.x) * x.y, x.x * x.y);
}

// By how much luminance has changed, over what it was.
float history_change(float now, float before) {
    if (before <= 0.0) {
        return now > 0.0 ? HISTORY_CHANGE_MAX : 0.0;
    }
    return min(abs(now - before) / before, HISTORY_CHANGE_MAX);
}

// The share of light that is that of the frame before: at most `most`, less by the largest of the weighted changes of position, normal and, to the third power, luminance.
float history_confidence(float most, vec3 weights, vec3 changes) {
    vec3 reducers = weights * vec3(changes.xy, changes.z * changes.z * changes.z);
    return most * clamp(1.0 - max(reducers.x, max(reducers.y, reducers.z)), 0.0, 1.0);
}

// What a pixel's light is scaled by to be so many times as bright as what is around at most; 0 bounds nothing, and neither does black.
float history_bound(float most, float luminance, float around) {
    float bound = most * around;
    return bound > 0.0 && luminance > bound ? bound / luminance : 1.0;
}

#endif
