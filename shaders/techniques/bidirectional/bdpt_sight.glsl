// How a camera sees a vertex of a light subpath: the pixel, the radiance that the vertex adds to it, weighted against all other ways to make the path, and the way in between.
//
// Thin lenses have a point of their own for each vertex. Veach 1997, 10.3.2; I. Georgiev, "Implementing Vertex Connection and Merging", 2012.
// Expects a push-constant block `push` with the camera's frame, the picture's size, the scene's corners and the walks of a group, `shows`, which says whether so many scatterings count,
// `body_of_camera`, and the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_SIGHT_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_SIGHT_GLSL

#include "techniques/bidirectional/bdpt_ends.glsl"
#include "techniques/bidirectional/bdpt_states.glsl"
#include "techniques/bidirectional/bdpt_vertex.glsl"
#include "transport/random.glsl"
#include "transport/warp.glsl"
#include "walk/medium_ray_state.glsl"

layout(constant_id = 53) const bool HAS_LENS = true;

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

// Radiance that a vertex adds to a pixel, if nothing stands between, and the way that tells.
vec3 splat(LightVertex vertex, uvec4 words, out uint pixel, out ShadowWay shadow) {
    Arrival a = end_of(vertex);
    SurfacePoint point = a.surface.point;
    Sight seen = sight(point.position, words);
    pixel = seen.pixel == SPLAT_NONE ? SPLAT_NONE : vertex.group * push.width * push.height + seen.pixel;
    uint bounces = vertex.bounce + 1u;
    float cos_lit = end_cos(a, vertex.medium, a.wo);
    shadow = ShadowWay(Ray(vec3(0.0), 0.0, vec3(0.0), 1.0), OUTSIDE, 0.0);
    if (pixel == SPLAT_NONE || !shows(bounces) || !(cos_lit > 0.0)) {
        return vec3(0.0);
    }
    // The eye's path is in its first state.
    uint lobes = lobes_into(0u, vertex.states);
    vec4 scattered = end_scattering(a, vertex.medium, seen.direction, a.wo, lobes);
    float importance = seen.importance / float(push.walks);
    vec3 found = vertex.power * scattered.rgb * (importance * end_cos(a, vertex.medium, seen.direction) / cos_lit);
    if (STRATEGY == STRATEGY_COMBINED) {
        float to_light = importance * end_mis_cos(a, vertex.medium, seen.direction) * mis_behind(vertex.weights, scattered.a);
        found *= mis_weight(to_light, 0.0);
    }
    if (!HAS_MEDIA) {
        found = absorbed(found, arrival_interior(arrival_from(a, seen.direction), OUTSIDE), length(seen.to));
    }
    shadow.ray.origin = offset_ray_origin(point.position, point.error, end_normal(a, vertex.medium), seen.direction);
    shadow.ray.direction = point.position + seen.to - shadow.ray.origin;
    if (HAS_MEDIA) {
        // From the camera on, whose body is known.
        vec3 end = shadow.ray.origin;
        shadow.ray.origin = point.position + seen.to;
        shadow.ray.direction = end - shadow.ray.origin;
        shadow.interior = body_of_camera();
    }
    return finite_or_black(found);
}

#endif
