// What kernels of places that gather from virtual lights have in common: what they count, what says where a place goes on, and random words.
//
// Expects connection.glsl, and a block `push` with `least_bounces`, `most_bounces` and `seed`.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_GATHER_PROGRESS_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_GATHER_PROGRESS_GLSL

#include "transport/random.glsl"

// Stand in walk_resume for a place that goes on in a later dispatch, and for one that has no light to gather or is done.
const uint LIGHTS_STOPPED = 0xFFFFFFFEu;
const uint LIGHTS_DONE = 0xFFFFFFFCu;
// Tells the candidates of these rays from those of the paths' own.
const uint LIGHT_RAY_SEED = 0x76706c73u;

layout(constant_id = 44) const bool COUNTS_BOUNCES = false;  // the path set bounds the number of scatterings

layout(set = 3, binding = 2, scalar) restrict buffer VirtualLightCounters {
    uint gathers;          // places that gathered
    uint remaining;        // places of a sweep that have not had all lights
    uint connections[2];   // 64 bits, low word first: pairs of a place and a light
    uint shadow_rays[2];   // those that might bring light
    uint nodes[2];         // of the tree of lights, that places looked at
} gather_counters;

// Whether the picture has what is scattered so often between a light source and the eye.
bool counts_bounces(uint bounces) { return !COUNTS_BOUNCES || (bounces >= push.least_bounces && bounces <= push.most_bounces); }

// Random words of a connection. The point and the way to it stand for the path, of which a stage between knows no number: under an orthographic camera ways
// are equal. `purpose` tells words of one connection apart.
uvec4 connection_words(Receiver r, uint number, uint purpose) {
    uvec3 place = floatBitsToUint(r.arrival.surface.point.position);
    uvec3 way = floatBitsToUint(r.arrival.wo);
    return pcg4d(uvec4(place, push.seed)) + pcg4d(uvec4(way.x ^ number, way.y, way.z + r.bounce, purpose));
}

#endif
