#version 460
// Walks of a host's own: those of a sequence begin at one point of a row, and all go the same way.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define CLERESTORY_SAMPLER SAMPLER_PCG
#include "transport/bodies.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 first;  // point of the row
    uint walks;
    vec3 along;  // from one point to the next
    WalkKey key;
    vec3 direction;
} push;

#include "walk/draws.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.walks) {
        return;
    }
    vec3 origin = push.first + float(walk_sequence(slot)) * push.along;
    walk_states_out[slot] = WalkState(origin, 1.0, push.direction, 0u, vec3(1.0), 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), OUTSIDE);
}
