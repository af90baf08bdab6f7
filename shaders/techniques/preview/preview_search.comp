#version 460
// Reflections that depend on where they are seen from: at pixels of some triangles, what a probe shows in the direction in which a search through its distances
// finds what the mirrored ray meets, in place of what it shows in the ray's own direction, which the shading before has added.
//
// Sources, bias and guarantees: techniques/preview/search.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"

#include "invocation.glsl"
#include "maps/packed_direction.glsl"
#include "scene/bindings.glsl"
#include "techniques/preview/frame.glsl"
#include "techniques/preview/probe.glsl"
#include "transport/surface.glsl"

layout(set = 0, binding = 0) uniform usampler2D seen_triangles;
layout(set = 0, binding = 1) uniform sampler2D seen_weights;
layout(set = 0, binding = 2, scalar) restrict readonly buffer Frames { PreviewFrame frames[]; };
layout(set = 0, binding = 3, scalar) restrict buffer Radiance { vec3 radiance[]; };
// What the probe's place sees: an octahedron of directions.
layout(set = 0, binding = 4) uniform sampler2D probe_distances;
layout(set = 0, binding = 5) uniform usampler2D probe_normals;

layout(push_constant, scalar) uniform Push {
    vec3 place;      // of the probe
    float farthest;  // distance of a surface from there, at most
    float tolerance;
} push;

float impostor_look_up(uint layer, vec3 l, float size);

#include "maps/impostor.glsl"

// In the one layer of surfaces that there is.
float impostor_look_up(uint layer, vec3 l, float size) {
    ivec2 texels = textureSize(probe_distances, 0);
    ivec2 p = min(ivec2((0.5 * octahedron_encode(l) + 0.5) * vec2(texels)), texels - 1);
    float distance = texelFetch(probe_distances, p, 0).x;
    if (!(distance < IMPOSTOR_NOTHING)) {
        return IMPOSTOR_NOTHING_INVERSE * size;
    }
    vec3 c = octahedron_decode((2.0 * vec2(p) + 1.0) / vec2(texels) - 1.0);
    vec3 n = unpack_octahedral(texelFetch(probe_normals, p, 0).x, PACKED_NORMAL_BITS);
    return impostor_plane_ratio(impostor_plane(1.0 / distance, n, c), l, size);
}

void main() {
    PreviewFrame frame = frames[0];
    uint i = invocation_index();
    if (i >= frame.width * frame.height) {
        return;
    }
    uvec2 pixel = uvec2(i % frame.width, i / frame.width);
    uint triangle = texelFetch(seen_triangles, ivec2(pixel), 0).x;
    if (triangle == NO_HIT || triangle < frame.first_triangle || triangle >= frame.end_triangle) {
        return;
    }
    vec2 at = (2.0 * vec2(pixel) + 1.0) / vec2(frame.width, frame.height) - 1.0;
    vec3 across = at.x * frame.right + at.y * frame.down;
    vec3 to_eye = -normalize(frame.is_parallel != 0u ? frame.forward : frame.forward + across);
    Surface s = surface_at(Hit(0.0, texelFetch(seen_weights, ivec2(pixel), 0).xy, triangle), frame.lower, frame.upper);
    SceneMaterial m = load_material(s.material);
    if (HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u) {
        return;
    }
    Bsdf b = surface_bsdf(m, s);
    vec3 facing = dot(to_eye, s.geometric_normal) < 0.0 ? -s.geometric_normal : s.geometric_normal;
    vec3 normal = adapt_shading_normal(surface_mapped_normal(m, s), facing, to_eye);
    float cos_o = dot(normal, to_eye);
    vec3 shine = microfacet_albedo(b, cos_o);
    if (shine == vec3(0.0)) {
        return;
    }
    vec3 r = normalize(2.0 * cos_o * normal - to_eye);
    ImpostorHit found = impostor_search(s.point.position - push.place, r, vec2(0.0, push.farthest), push.tolerance);
    // A ray that is none finds nothing, and what lies in the ray's own direction is there.
    if (dot(found.direction, found.direction) == 0.0 || found.direction == r) {
        return;
    }
    float level = probe_level(frame, b.alpha);
    vec3 change = shine * (directional_look_up(found.direction, level) - directional_look_up(r, level));
    uint target = frame.first_pixel + pixel.y * frame.stride + pixel.x;
    radiance[target] = max(radiance[target] + change, vec3(0.0));
}
