#version 460
// Adaptive samples, last stage: adds the samples of a wave to their pixels' sums, as many for each pixel as the wave has of its share.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool WRITE_AOVS = true;

#include "techniques/path/path_samples.glsl"
#include "techniques/path/path_shares.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_pixel;  // of the wave, in the band
    uint pixel_count;
    uint first_place;  // of the wave, in the round of the band
    uint slot_count;
} push;

void main() {
    if (gl_GlobalInvocationID.x >= push.pixel_count) {
        return;
    }
    uint pixel = push.first_pixel + gl_GlobalInvocationID.x;
    // The first and the last pixel may have places in other waves, too.
    uint first = max(path_shares[pixel].first_place, push.first_place) - push.first_place;
    uint end = min(path_shares[pixel + 1u].first_place - push.first_place, push.slot_count);
    add_samples(pixel, first, end - first);
}
