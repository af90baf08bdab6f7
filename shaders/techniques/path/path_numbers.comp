#version 460
// Adaptive samples, before the camera's rays: which sample of which pixel the path in each slot of a wave is. A wave is places of a round, one behind the other.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/path/path_shares.glsl"

layout(set = 0, binding = 0, scalar) restrict writeonly buffer PathNumbers { uvec2 path_numbers[]; };  // by slot: pixel of the picture, sample

layout(push_constant, scalar) uniform Push {
    uint band_pixel;   // the band's first pixel in the picture
    uint first_pixel;  // of the wave, in the band
    uint pixel_count;
    uint first_place;  // of the wave, in the round of the band
    uint slot_count;
} push;

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slot_count) {
        return;
    }
    uint place = push.first_place + slot;
    uint pixel = share_at(place, push.first_pixel, push.pixel_count);
    PathShare share = path_shares[pixel];
    path_numbers[slot] = uvec2(push.band_pixel + pixel, share.first_sample + (place - share.first_place));
}
