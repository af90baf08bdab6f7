#version 460
// Adds what vertices of light subpaths show the camera to their pixels, in integers: the sums are the same in whatever order.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/bidirectional/bdpt_set.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;  // vertices
} push;

// Steps are split where both parts are exact: below 2^30, and the rest.
const uint LOW_BITS = 30u;
const float LOW_RANGE = 1073741824.0;
// From here on floats are whole numbers.
const float WHOLE = 8388608.0;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) {
        return;
    }
    LightSplat splat = light_splats[index];
    if (splat.pixel == SPLAT_NONE) {
        return;
    }
    float per_step = 1.0 / splat_step(bdpt_counters.greatest_splat);
    for (uint band = 0u; band < 3u; ++band) {
        float value = uintBitsToFloat(splat.words[band]) * per_step;
        float steps = value < WHOLE ? floor(value + 0.5) : value;
        float high = floor(steps / LOW_RANGE);
        uint above = uint(high);
        uint low = uint(steps - high * LOW_RANGE) | above << LOW_BITS;
        uint carry = atomicAdd(splat_sums[splat.pixel].words[2u * band], low) > 0xFFFFFFFFu - low ? 1u : 0u;
        uint top = (above >> (32u - LOW_BITS)) + carry;
        if (top > 0u) {
            atomicAdd(splat_sums[splat.pixel].words[2u * band + 1u], top);
        }
    }
}
