#version 460
// Indirect light of a frame blended with that of the frame before, at each pixel: I = c I_before + (1 - c) I_now, with c the confidence that what was there is what is there now.
//
// The pixel's point is looked up where the camera before saw it, among four pixels, each of which counts where it showed the same object, in the point's tangent plane and with its
// normal; c is 0 without any. It falls with the distance of the point from those that stand for it, with the angle between normals, and with the change of luminance, of means over as many
// pixels as a filter has, since one pixel's noise is no change. Light is blended over the surface's colour; one band of it that had none before has c = 0. Light that is
// far brighter than what is around is scaled down before it enters. What is blended are differences, so that equal values stay as they are to the bit.
//
// SVO-G4: C. Sun, "Many-light real-time global illumination using sparse voxel octree", 2015, §2.2.4. Deterministic.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "finite.glsl"
#include "invocation.glsl"
#include "maps/packed_direction.glsl"
#include "raster/seen_normals.glsl"
#include "techniques/instant_radiosity/history.glsl"
#include "techniques/instant_radiosity/interleave.glsl"
#include "techniques/instant_radiosity/light_color.glsl"
#include "transport/luminance.glsl"

layout(push_constant, scalar) uniform Push {
    SeenFrom before;     // the frame before
    uint has_before;     // 0 for a first frame
    vec3 weights;        // of changes of position, normal and luminance
    float most;          // the greatest confidence
    float bound;         // of light over what is around
    float plane_max;     // distance from the tangent plane, m
    float normal_min;    // cosine of the angle between normals
    float extent;        // that changes of position are relative to, m
    uint interleave;     // tiles along a side
    uint adds;           // 1 where the picture has other light
    uint first_pixel;
    uint end_pixel;
} push;

layout(set = 0, binding = 0) uniform sampler2D seen_positions;  // w is 0 where there is nothing
layout(set = 0, binding = 1) uniform usampler2D seen_normals;
layout(set = 0, binding = 2) uniform usampler2D seen_objects;
layout(set = 0, binding = 3, scalar) restrict readonly buffer SplitColors { vec3 split_colors[]; };
layout(set = 0, binding = 4, scalar) restrict readonly buffer LightNow { vec3 light_now[]; };
layout(set = 0, binding = 5, scalar) restrict readonly buffer PixelsBefore { HistoryPixel pixels_before[]; };
layout(set = 0, binding = 6, scalar) restrict writeonly buffer PixelsNow { HistoryPixel pixels_now[]; };
layout(set = 0, binding = 7, scalar) restrict buffer Radiance { vec3 radiance[]; };

// What a pixel shows.
struct Shown {
    vec3 position;
    uint object;
    vec3 normal;
};

// Mean luminances of light over colour around a pixel, 0 where there is none.
struct Around {
    float now;
    float others;  // without the pixel
    float before;
};

uint pixel_number(ivec2 pixel) { return uint(pixel.y) * push.before.width + uint(pixel.x); }

bool is_inside(ivec2 pixel) {
    return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(push.before.width, push.before.height)));
}

vec3 pixel_color(ivec2 pixel) {
    return split_colors[interleave_split(uvec2(pixel), uvec2(push.before.width, push.before.height), push.interleave)];
}

bool is_same_surface(Shown a, Shown b) {
    return a.object == b.object && abs(dot(a.normal, b.position - a.position)) <= push.plane_max && dot(a.normal, b.normal) > push.normal_min;
}

// False where there is nothing.
bool shown_now(ivec2 pixel, out Shown shown) {
    vec4 position = texelFetch(seen_positions, pixel, 0);
    vec3 normal = shading_normal(texelFetch(seen_normals, pixel, 0).xy);
    shown = Shown(position.xyz, texelFetch(seen_objects, pixel, 0).x, normal);
    return position.w != 0.0;
}

// False where nothing was left.
bool shown_before(HistoryPixel pixel, out Shown shown) {
    shown = Shown(pixel.position, pixel.object, unpack_octahedral(pixel.normal, SHADING_NORMAL_BITS));
    return pixel.confidence != HISTORY_NONE;
}

Around around(ivec2 pixel, ivec2 pixel_before, bool has_before, Shown own) {
    int reach = max(int(push.interleave / 2u), 1);
    int side = 2 * reach + 1;
    vec3 sums = vec3(0.0);
    vec3 counts = vec3(0.0);
    for (int i = 0; i < side * side; ++i) {
        ivec2 offset = ivec2(i % side, i / side) - reach;
        ivec2 there = pixel + offset;
        Shown other;
        if (is_inside(there) && shown_now(there, other) && is_same_surface(own, other)) {
            float luminance = dot(finite_or_black(light_now[pixel_number(there)]) / divisor(pixel_color(there)), LUMINANCE.rgb);
            vec3 count = vec3(1.0, offset == ivec2(0) ? 0.0 : 1.0, 0.0);
            sums += luminance * count;
            counts += count;
        }
        there = pixel_before + offset;
        if (has_before && is_inside(there)) {
            HistoryPixel kept = pixels_before[pixel_number(there)];
            if (shown_before(kept, other) && is_same_surface(own, other)) {
                sums.z += dot(max(kept.light, 0.0), LUMINANCE.rgb);
                counts.z += 1.0;
            }
        }
    }
    vec3 means = sums / max(counts, 1.0);
    return Around(means.x, means.y, means.z);
}

// Light of the pixels that stand for the point, by band, and the confidence in it; 0 in bands of which there is none.
vec3 looked_up(Shown own, vec2 place, float change, out vec3 light, out float confidence) {
    ivec2 first;
    vec4 weights = history_weights(place, first);
    vec3 sums = vec3(0.0);
    vec3 counts = vec3(0.0);
    vec3 position = vec3(0.0);
    vec3 normal = vec3(0.0);
    float count = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 there = first + ivec2(i & 1, i >> 1);
        float weight = i == 0 ? weights.x : i == 1 ? weights.y : i == 2 ? weights.z : weights.w;
        if (weight == 0.0 || !is_inside(there)) {
            continue;
        }
        HistoryPixel kept = pixels_before[pixel_number(there)];
        Shown other;
        if (shown_before(kept, other) && is_same_surface(own, other)) {
            vec3 bands = weight * vec3(greaterThanEqual(kept.light, vec3(0.0)));
            sums += bands * kept.light;
            counts += bands;
            position += weight * (other.position - own.position);
            normal += weight * other.normal;
            count += weight;
        }
    }
    light = sums / mix(vec3(1.0), counts, greaterThan(counts, vec3(0.0)));
    confidence = 0.0;
    if (count > 0.0) {
        float turned = max(1.0 - dot(own.normal, normalize(normal)), 0.0);
        confidence = history_confidence(push.most, push.weights, vec3(length(position / count) / push.extent, turned, change));
    }
    return confidence * vec3(greaterThan(counts, vec3(0.0)));
}

void main() {
    uint number = push.first_pixel + invocation_index();
    if (number >= push.end_pixel) {
        return;
    }
    ivec2 pixel = ivec2(number % push.before.width, number / push.before.width);
    vec3 light = light_now[number];
    HistoryPixel kept = HistoryPixel(vec3(0.0), HISTORY_NONE, vec3(0.0), 0u, 0u);
    Shown own;
    // What is no number is shown as it is, for the film to count, and leaves nothing behind.
    if (shown_now(pixel, own) && all(lessThanEqual(light, vec3(FINITE_MAX)))) {
        vec3 color = pixel_color(pixel);
        vec3 now = light / divisor(color);
        vec2 place = vec2(0.0);
        bool has_before = push.has_before != 0u && history_place(push.before, own.position, place);
        place = clamp(place, vec2(-2.0), vec2(push.before.width, push.before.height) + 2.0);
        Around means = Around(0.0, 0.0, 0.0);
        if (push.bound > 0.0 || push.weights.z > 0.0) {
            means = around(pixel, ivec2(floor(place)), has_before, own);
        }
        float scale = history_bound(push.bound, dot(now, LUMINANCE.rgb), max(means.others, means.before));
        now *= scale;
        light *= scale;
        vec3 blended = now;
        kept.confidence = 0.0;
        if (has_before) {
            vec3 before;
            vec3 confidence = looked_up(own, place, history_change(means.now, means.before), before, kept.confidence);
            blended += confidence * (before - now);
        }
        // What is not blended is not divided and multiplied, which might not give the same bits.
        light = blended == now ? light : divisor(color) * blended;
        kept.light = mix(vec3(-1.0), blended, greaterThan(color, vec3(0.0)));
        kept.position = own.position;
        kept.normal = texelFetch(seen_normals, pixel, 0).y;
        kept.object = own.object;
    }
    pixels_now[number] = kept;
    radiance[number] = push.adds != 0u ? radiance[number] + light : light;
}
