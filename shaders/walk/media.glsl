// What walks know of media, behind the rest of their working memory in set 0, and how they pass the surfaces that bound media.
//
// A body is a solid that refracts or an invisible boundary. Walks carry the material of the innermost body they are in; what is outside of a
// body is known for each of its triangles, so bodies may lie in bodies, as long as their surfaces do not cross. A surface of a body tells
// by its side which body the way to it was in, whatever the walk believed: rounding cannot leave a walk in the wrong medium for good.
// Boundaries leave the ray as it is: the search for the next surface begins one rounding unit behind them. A surface at the same distance is
// not skipped, since boundaries have the last numbers of all triangles and ties go to the first one; of boundaries in one place only
// the first one is met.
#ifndef CLERESTORY_WALK_MEDIA_GLSL
#define CLERESTORY_WALK_MEDIA_GLSL

// Which is one set with this, whether a scene has media or not.
#include "walk/wave.glsl"

// There is nothing left for the shading stage.
const uint EVENT_HANDLED = 1u;

struct MediumState {
    vec3 bands;   // as in transport/medium.glsl
    float start;  // distance along the ray up to which the walk has come; negative by what the offset of its origin left out
};

struct MediumEvent {
    vec3 weight;  // of the throughput on the way to the surface
    uint flags;   // EVENT_HANDLED, FLAG_AIRLIGHT
};

// What is known of a place's shadow rays where they start.
struct ShadowStart {
    uint sampled_interior;
    uint airlight_interior;
    float start;  // of the sampled ray, as in ShadowState
};

struct ShadowState {
    vec3 transmittance;
    float start;  // as in MediumState, in lengths of the ray's direction
    Hit hit;
    uint interior;
    uint walks;  // through grids, so far
    uint rays;   // those still to follow: FLAG_AIRLIGHT, FLAG_SAMPLED; the first one is under way
};

layout(set = 0, binding = 16, scalar) restrict buffer WalkMediumStates { MediumState walk_medium_states[]; };  // by slot
layout(set = 0, binding = 17, scalar) restrict buffer WalkMediumEvents { MediumEvent walk_medium_events[]; };  // by place
layout(set = 0, binding = 18, scalar) restrict buffer WalkShadowStarts { ShadowStart walk_shadow_starts[]; };  // by place
layout(set = 0, binding = 19, scalar) restrict buffer WalkAirlightRays { ShadowRay walk_airlight_rays[]; };    // by place
layout(set = 0, binding = 20, scalar) restrict buffer WalkShadowStates { ShadowState walk_shadow_states[]; };  // by place in the waiting queue
// 64-bit counters, low word first.
layout(set = 0, binding = 21, scalar) restrict buffer WalkMediumCounters {
    uint collisions[2];
    uint null_collisions[2];
    uint density_lookups[2];
    uint second_rays[2];  // of places that have one already
} medium_counters;

#define COUNT_MEDIUM(COUNTER, AMOUNT) { \
    uint counted_amount = AMOUNT; \
    if (counted_amount > 0u && atomicAdd(medium_counters.COUNTER[0], counted_amount) > 0xFFFFFFFFu - counted_amount) { \
        atomicAdd(medium_counters.COUNTER[1], 1u); \
    } \
}

// The least distance that no device flushes to zero.
const float NORMAL_MIN = 1.17549435e-38;

// How far a ray has come that passes a surface at a distance of t.
float past_surface(float t) { return max(t, NORMAL_MIN); }

// The next greater float.
float next_distance(float t) { return t == 0.0 ? NORMAL_MIN : uintBitsToFloat(floatBitsToUint(t) + (t > 0.0 ? 1u : 0xFFFFFFFFu)); }

// Where the search for the next surface begins: at the next float behind the last one, if there was one.
float search_start(float start) { return start > 0.0 ? next_distance(start) : 0.0; }

// Where a walk that began at `start` goes on, stopped at t. Each round gets on, however little, lest there be no end of them.
float resumed_start(float start, float t) { return max(t, next_distance(start)); }

#endif
