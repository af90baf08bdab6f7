#version 460
// The vertices of a bounce of light subpaths behind those that are there, in the order of the queue: the same order on every run.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/bidirectional/bdpt_set.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint capacity;  // vertices
} push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.waiting_count) {
        return;
    }
    // The scan has counted this bounce already.
    uint vertex = status.waited[0] - status.waiting_count + place;
    if (vertex >= push.capacity) {
        return;
    }
    uint source = WAITING_QUARTERS * texelFetch(walk_waiting_queue_in, int(place)).x;
    for (uint i = 0u; i < LIGHT_VERTEX_QUARTERS; ++i) {
        light_vertices[LIGHT_VERTEX_QUARTERS * vertex + i] = texelFetch(walk_waiting_in, int(source + i));
    }
}
