// How walks pass the surfaces that bound media; what they keep of media is in walk/wave.glsl.
//
// A body is a solid that refracts or an invisible boundary. Walks carry the material of the innermost body they are in; what is outside a
// body is known for each of its triangles, so bodies may lie in bodies, as long as their surfaces do not cross. A surface of a body tells
// by its side which body the way to it was in, whatever the walk believed: rounding cannot leave a walk in the wrong medium for good.
// Boundaries leave the ray as it is: the search for the next surface begins one rounding unit behind them. A surface at the same distance is
// not skipped, since boundaries have the last numbers of all triangles and ties go to the first one; of boundaries in one place only
// the first one is met.
#ifndef CLERESTORY_WALK_MEDIA_GLSL
#define CLERESTORY_WALK_MEDIA_GLSL

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
