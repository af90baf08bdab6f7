#version 460
// Adds what light subpaths of the pass show the camera to what the eye paths of a wave have gathered: each sample of a pixel has a group of walks.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/bidirectional/bdpt_set.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_pixel;
    uint count;         // slots
    uint samples;       // of each pixel, in neighbouring slots
    uint first_sample;  // of the pass
    uint pixels;        // of the picture
} push;

const float WORD_RANGE = 4294967296.0;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.count) {
        return;
    }
    uint group = push.first_sample + slot % push.samples;
    SplatSum sum = splat_sums[group * push.pixels + push.first_pixel + slot / push.samples];
    float step = splat_step(bdpt_counters.greatest_splat);
    vec3 low = vec3(float(sum.words[0]), float(sum.words[2]), float(sum.words[4]));
    vec3 high = vec3(float(sum.words[1]), float(sum.words[3]), float(sum.words[5]));
    walk_gathered[slot].radiance += high * (WORD_RANGE * step) + low * step;
}
