#version 460
// What vertices of light subpaths show the camera: the pixel and the radiance that each adds to it, weighted against all other ways to make the path, where nothing
// stands between. The mean of a pixel's light is that over all walks of a group.
//
// A vertex whose ray a quota stops marks itself; further dispatches go on there. Thin lenses have a point of their own for each vertex.
// Veach 1997, 10.3.2; I. Georgiev, "Implementing Vertex Connection and Merging", 2012. Deterministic in (seed, pass, vertex).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"
#include "techniques/bidirectional/bdpt_both_ways.glsl"

layout(constant_id = 53) const bool HAS_LENS = true;

layout(push_constant, scalar) uniform Push {
    vec3 origin;
    float half_width;   // of the picture at distance 1, or in metres (orthographic)
    vec3 right;
    float half_height;
    vec3 up;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    uint width;
    uint height;
    vec3 scene_lower;
    uint least_bounces;
    vec3 scene_upper;
    uint most_bounces;
    uint pass;
    uint walks;         // of a group
    uint seed;
    uint first;         // vertex
    uint end;
    uint goes_on;       // 1 for vertices that have stopped
} push;

#include "transport/random.glsl"
#include "transport/warp.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

// Tells these draws from those of walks.
const uint SPLAT_SEED = 0x73706c61u;

// How the camera sees a point.
struct Sight {
    uint pixel;        // SPLAT_NONE where it does not
    vec3 to;           // from the point to the lens
    vec3 direction;    // unit
    float importance;  // density of the pixel's rays there per area across them, 1/m2
};

Sight sight(vec3 position, uvec4 words) {
    Sight s = Sight(SPLAT_NONE, vec3(0.0), vec3(0.0), 0.0);
    vec3 from = position - push.origin;
    vec2 shift = vec2(0.0);
    if (HAS_LENS) {
        vec2 lens = push.lens_radius * square_to_disk(vec2(unit_float(words.x), unit_float(words.y)));
        from -= lens.x * push.right + lens.y * push.up;
        shift = lens / push.focus_distance;
    }
    float depth = dot(from, push.forward);
    if (!(depth > 0.0)) {
        return s;
    }
    vec2 plane = vec2(dot(from, push.right), dot(from, push.up));
    plane = PARALLEL_CAMERA ? plane : plane / depth + shift;
    vec2 half_size = vec2(push.half_width, push.half_height);
    vec2 size = vec2(float(push.width), float(push.height));
    vec2 at = size * (0.5 + vec2(0.5, -0.5) * plane / half_size);
    if (!(all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, size)))) {
        return s;
    }
    s.pixel = uint(at.y) * push.width + uint(at.x);
    float pixels = size.x * size.y / (4.0 * half_size.x * half_size.y);
    if (PARALLEL_CAMERA) {
        s.to = -depth * push.forward;
        s.direction = -push.forward;
        s.importance = pixels;
        return s;
    }
    float squared = dot(from, from);
    float cos_camera = depth * inversesqrt(squared);
    s.to = -from;
    s.direction = -from * inversesqrt(squared);
    s.importance = pixels / (cos_camera * cos_camera * cos_camera * squared);
    return s;
}

// Radiance that a vertex adds to a pixel, if nothing stands between, and the ray that tells.
vec3 splat(LightVertex vertex, uvec4 words, out uint pixel, out Ray ray) {
    Arrival a = arrival_at(Hit(0.0, vertex.barycentrics, vertex.triangle), vertex.direction, push.scene_lower, push.scene_upper);
    SurfacePoint point = a.surface.point;
    Sight seen = sight(point.position, words);
    pixel = seen.pixel == SPLAT_NONE ? SPLAT_NONE : vertex.group * push.width * push.height + seen.pixel;
    uint bounces = vertex.bounce + 1u;
    float cos_lit = abs(dot(a.wo, a.surface.geometric_normal));
    ray = Ray(vec3(0.0), 0.0, vec3(0.0), 1.0);
    if (pixel == SPLAT_NONE || bounces < push.least_bounces || bounces > push.most_bounces || !(cos_lit > 0.0)) {
        return vec3(0.0);
    }
    vec4 scattered = scattering(a, seen.direction, a.wo);
    float importance = seen.importance / float(push.walks);
    vec3 found = vertex.power * scattered.rgb * (importance * abs(dot(seen.direction, a.surface.geometric_normal)) / cos_lit);
    if (STRATEGY == STRATEGY_COMBINED) {
        float to_light = importance * surface_cos(a, seen.direction) * mis_behind(vertex.weights, scattered.a);
        found *= mis_weight(to_light, 0.0);
    }
    found = absorbed(found, arrival_interior(arrival_from(a, seen.direction), OUTSIDE), length(seen.to));
    ray.origin = offset_ray_origin(point.position, point.error, a.surface.geometric_normal, seen.direction);
    ray.direction = point.position + seen.to - ray.origin;
    return finite_or_black(found);
}

void main() {
    uint index = push.first + gl_GlobalInvocationID.x;
    if (index >= push.end) {
        return;
    }
    uint cursor = INDEX_START;
    if (push.goes_on != 0u) {
        LightSplat before = light_splats[index];
        if (before.pixel != SPLAT_STOPPED) {
            return;
        }
        cursor = before.words.x;
    }
    uvec4 words = pcg4d(uvec4(index, push.pass, SPLAT_SEED, push.seed));
    uint pixel;
    Ray ray;
    vec3 radiance = splat(load_light_vertex(index), words, pixel, ray);
    if (cursor == INDEX_START) {
        COUNT_WIDE(bdpt_counters.in_view, pixel != SPLAT_NONE ? 1u : 0u)
        COUNT_WIDE(bdpt_counters.shadow_rays, radiance != vec3(0.0) ? 1u : 0u)
    }
    if (radiance == vec3(0.0)) {
        light_splats[index] = LightSplat(uvec3(0u), SPLAT_NONE);
        return;
    }
    if (HAS_ALPHA) {
        candidate_key = pcg4d(words);
    }
    Hit hit = no_hit(ray.t_max);
    cursor = any_hit(ray, cursor, hit);
    if (cursor != INDEX_FINISHED) {
        light_splats[index] = LightSplat(uvec3(cursor, 0u, 0u), SPLAT_STOPPED);
        atomicAdd(bdpt_counters.remaining, 1u);
        return;
    }
    bool open = hit.triangle == NO_HIT;
    light_splats[index] = LightSplat(floatBitsToUint(radiance), open ? pixel : SPLAT_NONE);
    if (open) {
        // Bits of numbers that are not negative have their order.
        atomicMax(bdpt_counters.greatest_splat, floatBitsToUint(largest_component(radiance)));
    }
}
