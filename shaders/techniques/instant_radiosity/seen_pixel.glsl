// Pixels of a G-buffer by number, and what they see as points that virtual lights light. Expects what seen_receiver.glsl does, and, declared before the inclusion, the
// pictures `seen_triangles` and `seen_weights`, and `seen` in the block `push`.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_PIXEL_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_PIXEL_GLSL

#include "techniques/instant_radiosity/seen_receiver.glsl"

uvec2 pixel_of(uint i) { return uvec2(i % push.seen.width, i / push.seen.width); }

// False where nothing is seen, or what scatters into single directions alone.
bool receiver_of(uint i, out Receiver r) {
    uvec2 pixel = pixel_of(i);
    SplitPlace seen = SplitPlace(texelFetch(seen_triangles, ivec2(pixel), 0).x, texelFetch(seen_weights, ivec2(pixel), 0).xy);
    return seen.triangle != NO_HIT && receiver_of_pixel(push.seen, pixel, seen, r);
}

#endif
