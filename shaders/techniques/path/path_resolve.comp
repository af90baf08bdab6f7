#version 460
// Wavefront path tracer, last stage: adds the samples of a wave to their pixels' sums, as many for each pixel.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool WRITE_AOVS = true;

#include "techniques/path/path_samples.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_film_pixel;  // of the wave, within this buffer
    uint pixel_count;
    uint sample_count;
} push;

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    if (pixel >= push.pixel_count) {
        return;
    }
    add_samples(push.first_film_pixel + pixel, pixel * push.sample_count, push.sample_count);
}
