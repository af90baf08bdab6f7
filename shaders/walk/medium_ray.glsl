// Rays through media that a kernel follows beside something else, stretch by stretch: boundaries are passed, every other surface blocks, and what the media let through is
// weighed. A stretch ends at a surface, or where a walk through a grid is stopped by its quota; where stretches end does not depend on how many of them share a dispatch.
//
// Homogeneous media in closed form, grids by ratio tracking: unbiased (transport/media_tracking.glsl). walk/shadow_media.glsl does the same for the shadow rays that wait in a wave.
// Expects accel/index.glsl, the media of scene/media.glsl, and the constants of transport/features.glsl and transport/media_features.glsl.
#ifndef CLERESTORY_WALK_MEDIUM_RAY_GLSL
#define CLERESTORY_WALK_MEDIUM_RAY_GLSL

#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "walk/media.glsl"
#include "walk/medium_ray_state.glsl"

// Iterations of such a ray's walk through a grid in one stretch. Each has as many, so that where walks stop does not depend on how many stretches share a dispatch; few, since
// those of all lanes and stretches add up to what software drivers run.
const uint CONNECTION_GRID_QUOTA = 64u;
// Random numbers of a walk through a grid, as a power of two; those of the next begin behind them.
const uint RATIO_WALK_SHIFT = 16u;

MediumRay begin_medium_ray(ShadowWay way) {
    return MediumRay(vec3(1.0), INDEX_START, no_hit(way.ray.t_max), way.start, way.interior, 0u);
}

// Searches on for the surface that ends the stretch; whether the search has ended.
bool search_stretch(Ray ray, inout MediumRay at) {
    at.cursor = closest_hit(Ray(ray.origin, search_start(at.start), ray.direction, ray.t_max), at.cursor, at.hit);
    return at.cursor == INDEX_FINISHED;
}

// Takes the stretch up to the next surface, to which the way has been searched, or of a grid as much as a walk's quota allows; true when the ray has ended, its
// transmittance known. `key` is that of the ray's walks through grids; `surrounding` the medium outside all bodies.
bool pass_stretch(Ray ray, uint surrounding, uvec4 key, inout MediumRay at) {
    bool met = at.hit.triangle != NO_HIT;
    Crossing crossing = Crossing(at.interior, OUTSIDE, false);
    if (met) {
        crossing = cross_surface(at.hit.triangle, ray.direction, at.interior);
        if (!crossing.boundary) {
            at.transmittance = vec3(0.0);
            return true;
        }
    }
    float scale = length(ray.direction);
    float way = max(at.hit.t - at.start, 0.0) * scale;
    uint medium = medium_inside(crossing.interior, surrounding);
    if (medium != NO_MEDIUM) {
        SceneMedium m = load_medium(medium);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            at.transmittance *= transmittance(m.sigma_t, way);
        } else if (HAS_GRIDS) {
            GridWalk walk = begin_grid_walk(m, ray.origin, ray.direction, at.start, at.hit.t);
            walk.draw = at.grid_walks << RATIO_WALK_SHIFT;
            ++at.grid_walks;
            uint iterations = CONNECTION_GRID_QUOTA;
            uint outcome = ratio_tracking(m, key, scale, walk, iterations, at.transmittance);
            float reached = resumed_start(at.start, walk.entry + walk.t);
            // The search that goes on from the surface itself would miss it.
            if (outcome == GRID_STOPPED && reached < at.hit.t) {
                at.start = reached;
                at.cursor = INDEX_START;
                at.hit = no_hit(ray.t_max);
                return false;
            }
        }
    }
    if (HAS_ABSORPTION && crossing.interior != OUTSIDE) {
        at.transmittance *= transmittance(load_material(crossing.interior).absorption, way);
    }
    at.start = past_surface(at.hit.t);
    at.interior = crossing.beyond;
    at.cursor = INDEX_START;
    at.hit = no_hit(ray.t_max);
    return !met || at.transmittance == vec3(0.0);
}

#endif
