#version 460
// A G-buffer by tiles: what each place of the split picture sees, and that it has had none of its subset of the lights.
//
// SVO-P7: the split G-buffer of interleaved sampling. Position, normal and material follow from the triangle and the weights of its corners, so that a place is 12
// bytes and loses nothing.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "accel/index_rays.glsl"
#include "accel/ray.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/split_place.glsl"

layout(push_constant, scalar) uniform Push {
    uint width;
    uint height;
    uint interleave;    // tiles along a side
    uint subsets;       // of the lights
    uint first_subset;  // of the first tile
    uint lights;
} push;

layout(set = 0, binding = 0) uniform usampler2D seen_triangles;
layout(set = 0, binding = 1) uniform sampler2D seen_weights;
layout(set = 0, binding = 2, scalar) restrict writeonly buffer SplitPlaces { SplitPlace split_places[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer SplitStates { GatherState split_states[]; };

void main() {
    uint place = invocation_index();
    uvec2 size = uvec2(push.width, push.height);
    uint stride = interleave_stride(size, push.interleave);
    if (place >= stride * push.interleave * push.interleave) {
        return;
    }
    uvec2 pixel;
    SplitPlace seen = SplitPlace(NO_HIT, vec2(0.0));
    if (interleave_merge(place, size, push.interleave, pixel)) {
        seen.triangle = texelFetch(seen_triangles, ivec2(pixel), 0).x;
        seen.weights = texelFetch(seen_weights, ivec2(pixel), 0).xy;
    }
    split_places[place] = seen;
    uint subset = interleave_subset_of_tile(place / stride, push.first_subset, push.subsets);
    uint first = interleave_lights(subset, push.subsets, push.lights).x;
    split_states[place] = GatherState(vec3(0.0), first, INDEX_START);
}
