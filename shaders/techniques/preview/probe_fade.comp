#version 460
// The map that a probe shows on its way to the next one: each number goes a part of what is left. Numbers that are equal stay as they are, to the bit. Sources and guarantees:
// techniques/preview/fading.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
    float part;  // of what is left, below 1
} push;

layout(set = 0, binding = 0, scalar) restrict buffer Shown { float shown[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer Coming { float coming[]; };

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        float from = shown[i];
        shown[i] = from + push.part * (coming[i] - from);
    }
}
