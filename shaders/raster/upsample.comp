#version 460
// A picture of few pixels at those of a larger one of the same view: bilinear, over neighbours on the same surface alone. Pixels without such neighbours, or next to none,
// are defective: black, and marked, to be worked out themselves.
//
// What is averaged are differences, so that equal values stay as they are to the bit.
//
// BG-13: T. Engelhardt, "Efficient From-Point Visibility for Global Illumination in Virtual Scenes with Participating Media", 2013, §8.2.3 and §11.3. Deterministic. Twin of raster/upsample.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/same_surface.glsl"
#include "raster/seen_normals.glsl"
#include "raster/upsample.glsl"

layout(push_constant, scalar) uniform Push {
    uvec2 coarse_size;
    uvec2 fine_size;
    float plane_max;   // distance from the tangent plane, m
    float normal_min;  // cosine of the angle between normals
} push;

layout(set = 0, binding = 0) uniform sampler2D coarse_positions;  // w is 0 where there is nothing
layout(set = 0, binding = 1) uniform usampler2D coarse_normals;
layout(set = 0, binding = 2) uniform sampler2D fine_positions;
layout(set = 0, binding = 3) uniform usampler2D fine_normals;
layout(set = 0, binding = 4, scalar) restrict readonly buffer CoarseValues { vec3 coarse_values[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer FineValues { vec3 fine_values[]; };
layout(set = 0, binding = 6, scalar) restrict writeonly buffer Defective { uint defective[]; };  // 1 for those
layout(set = 0, binding = 7, scalar) restrict buffer DefectiveCount { uint defective_count; };

void main() {
    uint i = invocation_index();
    if (i >= push.fine_size.x * push.fine_size.y) {
        return;
    }
    ivec2 pixel = ivec2(i % push.fine_size.x, i / push.fine_size.x);
    vec4 position = texelFetch(fine_positions, pixel, 0);
    fine_values[i] = vec3(0.0);
    defective[i] = 0u;
    if (position.w == 0.0) {
        return;
    }
    vec3 normal = shading_normal(texelFetch(fine_normals, pixel, 0).xy);
    vec2 place = (vec2(pixel) + 0.5) * (vec2(push.coarse_size) / vec2(push.fine_size)) - 0.5;
    ivec2 first = ivec2(floor(place));
    vec2 beyond = place - vec2(first);
    float sum = 0.0;
    // The first neighbour that counts, and what all differ from it.
    vec3 middle = vec3(0.0);
    vec3 differences = vec3(0.0);
    for (int k = 0; k < 4; ++k) {
        ivec2 step = ivec2(k & 1, k >> 1);
        ivec2 other = first + step;
        vec2 along = mix(1.0 - beyond, beyond, vec2(step));
        float weight = along.x * along.y;
        // One of no weight, whose value may be no number, is no neighbour.
        bool is_inside = all(greaterThanEqual(other, ivec2(0))) && all(lessThan(other, ivec2(push.coarse_size)));
        if (is_inside && weight > 0.0) {
            vec4 there = texelFetch(coarse_positions, other, 0);
            bool is_near = there.w != 0.0 && lies_in_plane(position.xyz, normal, there.xyz, push.plane_max);
            if (is_near && is_same_normal(normal, shading_normal(texelFetch(coarse_normals, other, 0).xy), push.normal_min)) {
                vec3 value = coarse_values[uint(other.y) * push.coarse_size.x + uint(other.x)];
                if (sum == 0.0) {
                    middle = value;
                }
                differences += weight * (value - middle);
                sum += weight;
            }
        }
    }
    if (sum >= UPSAMPLE_WEIGHT_MIN) {
        fine_values[i] = middle + differences / sum;
    } else {
        defective[i] = 1u;
        atomicAdd(defective_count, 1u);
    }
}
