// Which candidate hits count for a ray: all, or, specialized so, those where the material's alpha says that there is a surface. What the trace
// stages have in common stands here: their constants, and the push constants of all their kinds.
//
// A blended surface is met with probability alpha, drawn from a hash of (seed, sequence, index, bounce, kind of ray, triangle): the same
// answer however often the traversal asks, and whatever index it walks.
#ifndef CLERESTORY_WALK_CANDIDATES_GLSL
#define CLERESTORY_WALK_CANDIDATES_GLSL

#define CLERESTORY_SAMPLER SAMPLER_PCG
#include "walk/count_fetches.glsl"
#include "walk/wave.glsl"

// What a scene has, by the ids of transport/features.glsl.
layout(constant_id = 17) const bool HAS_ALPHA = true;
layout(constant_id = 19) const bool HAS_MEDIA = true;
// Goes on with rays that the quota stopped in an earlier dispatch; without it, only with rays that were left for later before they began.
layout(constant_id = 18) const bool RESUMES = false;
// Loop iterations of a ray from which on they count as work of the submission.
layout(constant_id = 27) const uint WORK_LEAST = WORK_UNIT;
// Walks have numbers of their own.
layout(constant_id = 28) const bool NUMBERED = false;
#define CLERESTORY_NUMBERED NUMBERED

layout(push_constant, scalar) uniform Push {
    WalkKey key;
    uint surrounding;  // index of the medium outside all bodies, or NO_MEDIUM
    uint goes_on;      // 1 where an earlier dispatch has handled a part of the places, as walk_resume says
} push;

#include "transport/attribute_features.glsl"
#include "scene/material.glsl"
#include "walk/draws.glsl"

// Quarters of a material that say where there is a surface: base colour, flags, cutoff and texture.
const uint COVERAGE_QUARTERS = 3u;

const uint CANDIDATES_EXTEND = 0u;
const uint CANDIDATES_SHADOW = 1u;

// (sequence, index, bounce and kind, seed) of the ray under way.
uvec4 candidate_key;

void begin_candidates(uint slot, uint bounce, uint kind) {
    if (HAS_ALPHA) {
        count_quarters(NUMBERED ? 1u : 0u);
        candidate_key = uvec4(walk_sequence(slot), walk_index(slot), bounce * 2u + kind, push.key.seed);
    }
}

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

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#define INDEX_RESUMES RESUMES
#include "accel/index.glsl"

#endif
