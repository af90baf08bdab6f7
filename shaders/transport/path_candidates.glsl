// Which candidate hits count for a path: all, or (with PATH_ALPHA defined) those where the material's alpha says that there is a surface.
//
// A blended surface is met with probability alpha, drawn from a hash of (seed, pixel, sample, bounce, kind of ray, triangle): the same
// answer however often the traversal asks, and whatever index it walks.
#ifndef CLERESTORY_TRANSPORT_PATH_CANDIDATES_GLSL
#define CLERESTORY_TRANSPORT_PATH_CANDIDATES_GLSL

#include "transport/path_buffers.glsl"
#include "transport/path_dimensions.glsl"

// Goes on with rays that the quota stopped in an earlier dispatch.
layout(constant_id = 18) const bool RESUMES = false;

const uint CANDIDATES_EXTEND = 0u;
const uint CANDIDATES_SHADOW = 1u;

#if defined(PATH_ALPHA) || defined(PATH_MEDIA)

#define CLERESTORY_SAMPLER SAMPLER_PCG
#include "transport/random.glsl"

layout(push_constant, scalar) uniform Push {
    uint first_pixel;
    uint first_sample;
    uint sample_count;
    uint seed;
#ifdef PATH_MEDIA
    uint surrounding;  // index of the medium outside of all bodies, or NO_MEDIUM
#endif
} push;

#endif

#ifdef PATH_ALPHA

#include "transport/attribute_features.glsl"
#include "scene/material.glsl"

// (pixel, sample, bounce and kind, seed) of the ray under way.
uvec4 candidate_key;

void begin_candidates(uint slot, uint bounce, uint kind) {
    candidate_key = uvec4(push.first_pixel + slot / push.sample_count, push.first_sample + slot % push.sample_count,
                          bounce * 2u + kind, push.seed);
}

bool accept_candidate(uint triangle, vec2 barycentrics) {
    SceneMaterial m = load_material(load_triangle(triangle).material);
    if ((m.flags & (MATERIAL_MASK | MATERIAL_BLEND)) == 0u) {
        return true;
    }
    vec3 w = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    vec4 uvs = vec4(0.0);
    vec4 color = vec4(1.0);
    if (HAS_TEXTURES || HAS_VERTEX_COLORS) {
        uvec3 v = load_vertices(triangle);
        if (HAS_TEXTURES) {
            uvs = interpolate_attribute(scene_uvs, v, w);
        }
        if (HAS_VERTEX_COLORS) {
            color = interpolate_attribute(scene_colors, v, w);
        }
    }
    float coverage = material_coverage(m, material_base_color(m, uvs, color).a);
    uint bits = pcg4d(pcg4d(candidate_key) + uvec4(triangle, 0u, 0u, 0u)).w;
    return unit_float(bits) < coverage;
}

#define CLERESTORY_CANDIDATE_FILTER
#define BEGIN_CANDIDATES(SLOT, BOUNCE, KIND) begin_candidates(SLOT, BOUNCE, KIND);

#else

#define BEGIN_CANDIDATES(SLOT, BOUNCE, KIND)

#endif

#define INDEX_RESUMES RESUMES
#include "accel/index.glsl"

#endif
