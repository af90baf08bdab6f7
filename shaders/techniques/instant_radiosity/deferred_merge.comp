#version 460
// The split picture's sums back at their pixels, as means over all lights, and filtered there: light of neighbours on the same surface, which other subsets of the
// lights brought, is averaged; their colours are not.
//
// A neighbour counts where it lies in the pixel's tangent plane, as far as a threshold allows, and has its normal, as far as another does: on a flat surface the window,
// n pixels wide with rims of half weight where n is even, has each subset once. The pixel itself always counts. What is averaged are differences, so that equal values
// stay as they are to the bit.
//
// SVO-P13, SVO-P14: C. Sun, 2015, §4.11 and §4.12, after S. Laine et al., "Incremental Instant Radiosity for Real-Time Indirect Illumination", 2007. Deterministic.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/light_color.glsl"
#include "techniques/instant_radiosity/split_place.glsl"

layout(constant_id = 145) const bool FILTERS = true;
layout(constant_id = 146) const bool ADDS = true;  // to what the picture has already

layout(push_constant, scalar) uniform Push {
    uint width;
    uint height;
    uint interleave;   // tiles along a side
    uint subsets;      // of the lights
    uint first_subset; // of the first tile
    uint lights;
    float scale;       // of sums over all lights
    float plane_max;   // distance from the tangent plane, m
    float normal_min;  // cosine of the angle between normals
    uint first_pixel;
    uint end_pixel;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer SplitStates { GatherState split_states[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer SplitColors { vec3 split_colors[]; };
layout(set = 0, binding = 2) uniform sampler2D seen_positions;  // w is 0 where there is nothing
layout(set = 0, binding = 3) uniform usampler2D seen_normals;
layout(set = 0, binding = 4, scalar) restrict buffer Radiance { vec3 radiance[]; };

#include "techniques/instant_radiosity/seen_surface.glsl"

// What a place has of all lights, by its subset of them.
vec3 merged(uint place) {
    uint tile = place / interleave_stride(uvec2(push.width, push.height), push.interleave);
    uint subset = interleave_subset_of_tile(tile, push.first_subset, push.subsets);
    uvec2 of_subset = interleave_lights(subset, push.subsets, push.lights);
    return split_states[place].sum * (push.scale * (float(push.lights) / float(of_subset.y - of_subset.x)));
}

// 1 for bands in which both colours are something, or both nothing: what one shows of the light there tells of the other.
vec3 alike(vec3 a, vec3 b) { return vec3(equal(greaterThan(a, vec3(0.0)), greaterThan(b, vec3(0.0)))); }

// Of a pixel that is so far from the middle of the window along an axis.
float window_weight(int offset) { return 2 * abs(offset) == int(push.interleave) ? 0.5 : 1.0; }

vec3 filtered(uvec2 pixel) {
    uvec2 size = uvec2(push.width, push.height);
    uint place = interleave_split(pixel, size, push.interleave);
    vec3 value = merged(place);
    vec4 position = texelFetch(seen_positions, ivec2(pixel), 0);
    if (position.w == 0.0) {
        return value;
    }
    vec3 normal = seen_normal(ivec2(pixel));
    vec3 color = split_colors[place];
    vec3 middle = value / divisor(color);
    vec3 differences = vec3(0.0);
    vec3 count = vec3(1.0);
    uint reach = push.interleave / 2u;
    uint side = 2u * reach + 1u;
    for (uint i = 0u; i < side * side; ++i) {
        ivec2 offset = ivec2(i % side, i / side) - int(reach);
        ivec2 other = ivec2(pixel) + offset;
        if (offset == ivec2(0) || any(lessThan(other, ivec2(0))) || any(greaterThanEqual(other, ivec2(size)))) {
            continue;
        }
        if (is_same_surface(position.xyz, normal, other, push.plane_max, push.normal_min)) {
            uint neighbour = interleave_split(uvec2(other), size, push.interleave);
            vec3 counts = window_weight(offset.x) * window_weight(offset.y) * alike(color, split_colors[neighbour]);
            differences += counts * (merged(neighbour) / divisor(split_colors[neighbour]) - middle);
            count += counts;
        }
    }
    // Without neighbours the division is not undone, which might not give the same bits.
    return differences == vec3(0.0) ? value : divisor(color) * (middle + differences / count);
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    uvec2 pixel = uvec2(i % push.width, i / push.width);
    vec3 light;
    if (FILTERS) {
        light = filtered(pixel);
    } else {
        light = merged(interleave_split(pixel, uvec2(push.width, push.height), push.interleave));
    }
    radiance[i] = ADDS ? radiance[i] + light : light;
}
