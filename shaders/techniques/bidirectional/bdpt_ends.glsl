// Where subpaths meet others: on a surface or, in kernels with media (CLERESTORY_MEDIA_BOUND), at a collision with a medium, which scatters by its phase function and has no cosine.
// Of a collision an arrival has the place and the way there alone.
// Expects a push-constant block `push` with the scene's corners `scene_lower` and `scene_upper`, and the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_ENDS_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_ENDS_GLSL

#include "techniques/bidirectional/bdpt_both_ways.glsl"
#include "techniques/bidirectional/bdpt_vertex.glsl"
#include "transport/path_set.glsl"
#ifdef CLERESTORY_MEDIA_BOUND
#include "scene/media.glsl"
#include "transport/phase.glsl"
#endif

bool is_collision(uint medium) { return HAS_MEDIA && medium != NO_MEDIUM; }

Arrival collision_at(vec3 position, vec3 direction) {
    Arrival a;
    a.surface.point = SurfacePoint(position, vec3(0.0));
    a.wo = -direction;
    return a;
}

// Where a light subpath has left a vertex.
Arrival end_of(LightVertex vertex) {
    if (is_collision(vertex.medium)) {
        return collision_at(vertex.position, vertex.direction);
    }
    return arrival_at(Hit(0.0, vertex.barycentrics, vertex.triangle), vertex.direction, push.scene_lower, push.scene_upper);
}

// As scattering_by, at either.
vec4 end_scattering(Arrival a, uint medium, vec3 wo, vec3 wi, uint lobes) {
#ifdef CLERESTORY_MEDIA_BOUND
    if (is_collision(medium)) {
        SceneMedium m = load_medium(medium);
        float phase = phase_function(m.phase, m.phase_parameter, -wo, wi);
        return vec4((lobes & LOBE_VOLUME) != 0u ? vec3(phase) : vec3(0.0), phase);
    }
#endif
    return scattering_by(a, wo, wi, HAS_PATH_AUTOMATON ? lobes & LOBE_ALL : LOBE_ALL);
}

// Cosine to the geometric normal; and one that densities are made with.
float end_cos(Arrival a, uint medium, vec3 w) { return is_collision(medium) ? 1.0 : abs(dot(w, a.surface.geometric_normal)); }
float end_mis_cos(Arrival a, uint medium, vec3 w) { return is_collision(medium) ? 1.0 : surface_cos(a, w); }

vec3 end_normal(Arrival a, uint medium) { return is_collision(medium) ? vec3(0.0) : a.surface.geometric_normal; }

#endif
