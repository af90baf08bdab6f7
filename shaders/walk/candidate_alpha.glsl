// Whether a material's alpha says that there is a surface at a candidate hit.
//
// A blended surface is met with probability alpha, drawn from a hash of `candidate_key` and the triangle: the same answer however often the
// traversal asks, and whatever index it walks. Expects the constant HAS_ALPHA, those of transport/attribute_features.glsl, and transport/random.glsl.
#ifndef CLERESTORY_WALK_CANDIDATE_ALPHA_GLSL
#define CLERESTORY_WALK_CANDIDATE_ALPHA_GLSL

#include "scene/fetches.glsl"
#include "scene/material.glsl"

// Quarters of a material that say where there is a surface: base colour, flags, cutoff and texture.
const uint COVERAGE_QUARTERS = 3u;

// Of the ray under way; no two rays of a picture that are independent of each other share it.
uvec4 candidate_key;

bool accept_candidate(uint triangle, vec2 barycentrics) {
    SceneInstance at = instance_of(triangle);
    count_quarters(COVERAGE_QUARTERS);
    SceneMaterial m = load_material(load_triangle_of(at, triangle).material);
    if ((m.flags & (MATERIAL_MASK | MATERIAL_BLEND)) == 0u) {
        return true;
    }
    vec3 w = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec4 uvs = vec4(0.0);
    vec4 color = vec4(1.0);
    if (HAS_TEXTURES || HAS_VERTEX_COLORS) {
        uvec3 v = load_vertices_of(at, triangle);
        if (HAS_TEXTURES) {
            count_quarters(3u);
            uvs = interpolate_attribute(scene_uvs, v, w);
        }
        if (HAS_VERTEX_COLORS) {
            count_quarters(3u);
            color = interpolate_attribute(scene_colors, v, w);
        }
    }
    float coverage = material_coverage(m, material_base_color(m, uvs, color).a);
    uint bits = pcg4d(pcg4d(candidate_key) + uvec4(triangle, 0u, 0u, 0u)).w;
    return unit_float(bits) < coverage;
}

#endif
