#version 460
// Wavefront path tracer, last stage: adds consecutive samples of a wave to their pixels' sums, as many for each pixel in the wave.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool WRITE_AOVS = true;

#include "techniques/path/path_samples.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_film_pixel;  // within this buffer
    uint pixel_count;
    uint sample_count;      // of each pixel in the wave
    uint first_sample;      // of the first pixel: those before are there
    uint slot_count;        // of samples that are added
    uint first_slot;        // of them
} push;

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    if (pixel >= push.pixel_count) {
        return;
    }
    // The first and the last pixel may get a part of their samples.
    uint begin = max(pixel * push.sample_count, push.first_sample) - push.first_sample;
    uint end = min((pixel + 1u) * push.sample_count - push.first_sample, push.slot_count);
    add_samples(push.first_film_pixel + pixel, push.first_slot + begin, end - begin);
}
