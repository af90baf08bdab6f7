#version 460
// A frame of a host's own: every pixel shows its place in the picture, and a random number.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define CLERESTORY_SAMPLER 1u
#include "invocation.glsl"
#include "transport/random.glsl"

layout(push_constant, scalar) uniform Push {
    uint width;
    uint height;
    uint seed;
    uint frame;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Radiance { vec3 radiance[]; };

void main() {
    uint i = invocation_index();
    if (i >= push.width * push.height) {
        return;
    }
    float number = unit_float(pcg4d(uvec4(i, push.frame, 0u, push.seed)).x);
    radiance[i] = vec3(float(i % push.width) / float(push.width), float(i / push.width) / float(push.height), number);
}
