#version 460
// Light of the texels of a reflective shadow map to what pixels see, without visibility: those in a disc about the place where the map shows the pixel's point, by
// samples that lie denser in the middle of it.
//
// SVO-G1: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", 2005. Deterministic in (seed, frame, pixel).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(constant_id = 40) const uint DISC_SAMPLES = 1u;     // of a pixel, in a view
layout(constant_id = 41) const bool DISC_SQUARED = false;  // the published weight, not the density's

#include "transport/features.glsl"
#include "accel/index_rays.glsl"
#include "invocation.glsl"
#include "raster/reflective.glsl"
#include "techniques/instant_radiosity/rsm.glsl"

layout(push_constant, scalar) uniform Push {
    SeenFrom seen;
    vec3 scene_lower;
    float edge_bound;  // of EDGE_BOUND
    vec3 scene_upper;
    float radius;      // of the disc, texels
    uint view;
    uint first_pixel;
    uint end_pixel;
    uint frame;
    uint seed;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;  // none are read

#include "techniques/instant_radiosity/new_virtual_light.glsl"
#include "transport/random.glsl"

layout(set = 0, binding = 1) uniform usampler2D seen_triangles;
layout(set = 0, binding = 2) uniform sampler2D seen_weights;
layout(set = 0, binding = 3, scalar) restrict readonly buffer RsmEmitters { RsmEmitter rsm_emitters[]; };
layout(set = 0, binding = 4, scalar) restrict readonly buffer RsmViews { RsmView rsm_views[]; };
layout(set = 0, binding = 5, scalar) restrict readonly buffer RsmTexels { RsmTexel rsm_texels[]; };
layout(set = 0, binding = 6, scalar) restrict buffer Radiance { vec3 radiance[]; };

#include "techniques/instant_radiosity/seen_pixel.glsl"

// Where a view shows a point, in texels; false behind it.
bool place_in_view(SeenFrom from, vec3 position, out vec2 place) {
    vec3 way = position - from.origin;
    float depth = from.is_parallel != 0u ? 1.0 : dot(way, from.forward);
    vec2 across = vec2(dot(way, from.right) / dot(from.right, from.right), dot(way, from.down) / dot(from.down, from.down));
    place = (0.5 + 0.5 * across / depth) * vec2(from.width, from.height);
    return depth > 0.0;
}

void main() {
    uint index = push.first_pixel + invocation_index();
    if (index >= push.end_pixel) {
        return;
    }
    Receiver r;
    if (!receiver_of(index, r)) {
        return;
    }
    RsmView view = rsm_views[push.view];
    vec2 middle;
    if (!place_in_view(view.seen, r.arrival.surface.point.position, middle)) {
        return;
    }
    RsmEmitter emitter = rsm_emitters[view.emitter];
    uint side = view.seen.width;
    uvec4 shift = pcg4d(uvec4(index, push.frame, push.view, push.seed));
    vec3 sum = vec3(0.0);
    uint number = 0u;
    do {
        // Turned for each pixel.
        vec2 point = fract(vec2((float(number) + unit_float(shift.x)) / float(DISC_SAMPLES), rsm_radical_inverse(number, 2u) + unit_float(shift.y)));
        vec2 place = middle + rsm_disc_place(point, push.radius);
        bool is_inside = all(greaterThanEqual(place, vec2(0.0))) && all(lessThan(place, vec2(side)));
        RsmTexel texel = RsmTexel(NO_HIT, vec2(0.0), vec3(0.0));
        if (is_inside) {
            texel = rsm_texels[(push.view * side + uint(place.y)) * side + uint(place.x)];
        }
        if (texel.power != vec3(0.0)) {
            SceneTriangle t = load_triangle(texel.triangle);
            vec3 reached = t.a + texel.weights.x * (t.b - t.a) + texel.weights.y * (t.c - t.a);
            vec3 direction = rsm_direction(emitter, reached);
            Arrival a = arrival_at(Hit(0.0, texel.weights, texel.triangle), direction, push.scene_lower, push.scene_upper);
            Ray ray;
            vec3 found = connection(r, new_virtual_light(a, texel.triangle, texel.weights, texel.power, direction, 0u), ray);
            sum += rsm_disc_weight(point.x, push.radius, DISC_SQUARED) * found;
        }
        ++number;
    } while (number < DISC_SAMPLES);
    radiance[index] += r.throughput * sum / float(DISC_SAMPLES);
}
