// Shadow rays in scenes with media: boundaries are passed, every other surface blocks.
//
// Homogeneous media in closed form, grids by ratio tracking: unbiased. A ray that has met too many surfaces, or whose traversal or grid walk a quota
// stops, stalls the wave and goes on from where it is. One that is left for later before it began has the state that it begins with.
#ifndef CLERESTORY_WALK_SHADOW_MEDIA_GLSL
#define CLERESTORY_WALK_SHADOW_MEDIA_GLSL

#include "transport/bodies.glsl"
#include "transport/media_features.glsl"
#include "transport/media_tracking.glsl"
#include "walk/candidates.glsl"
#include "walk/media.glsl"

layout(constant_id = 10) const bool HAS_ABSORPTION = true;  // absorbing solids

// Surfaces met in one dispatch. With alpha, a traversal's iterations add up over the lanes.
const uint SHADOW_SURFACES = 8u;
const uint SHADOW_SURFACES_ALPHA = 2u;
// Random numbers of a walk through a grid, as a power of two; those of the next begin behind them.
const uint GRID_WALK_SHIFT = 16u;
// Stands for the round in the key of shadow rays' random numbers, so that those of ways do not return.
const uint SHADOW_KEY = 0x40000000u;

// Of a place's rays, the one that is first in `rays`.
ShadowRay first_ray(uint place, uint rays) {
    if ((rays & FLAG_AIRLIGHT) != 0u) {
        return walk_airlight_rays[place];
    }
    return load_shadow_ray(place);
}

ShadowState begin_ray(uint place, uint rays, float t_max, uint grid_walks) {
    ShadowStart from = walk_shadow_starts[place];
    bool airlight = (rays & FLAG_AIRLIGHT) != 0u;
    return ShadowState(vec3(1.0), airlight ? 0.0 : from.start, no_hit(t_max), airlight ? from.airlight_interior : from.sampled_interior,
                       grid_walks, rays);
}

// The next surface of a ray to which the way has been searched: passes a boundary, ends elsewhere. True when the ray has ended, its transmittance
// known; GRID_STOPPED in `outcome` where a walk through a grid has to go on.
bool pass_surface(ShadowRay s, inout ShadowState state, inout uint iterations, out uint outcome) {
    bool met = state.hit.triangle != NO_HIT;
    Crossing crossing = Crossing(s.t_max < FAR_AWAY ? state.interior : OUTSIDE, OUTSIDE, false);
    if (met) {
        crossing = cross_surface(state.hit.triangle, s.direction, state.interior);
    }
    if (met && !crossing.boundary) {
        state.transmittance = vec3(0.0);
    }
    outcome = GRID_LEFT;
    float scale = length(s.direction);
    uint medium = medium_inside(crossing.interior, push.surrounding);
    if (medium != NO_MEDIUM && state.transmittance != vec3(0.0)) {
        count_quarters(medium_quarters());
        SceneMedium m = load_medium(medium);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            state.transmittance *= transmittance(m.sigma_t, max(state.hit.t - state.start, 0.0) * scale);
        } else if (HAS_GRIDS) {
            GridWalk walk = begin_grid_walk(m, s.origin, s.direction, state.start, state.hit.t);
            walk.draw = state.grid_walks << GRID_WALK_SHIFT;
            ++state.grid_walks;
            count_quarters(NUMBERED ? 1u : 0u);
            uvec4 key = uvec4(walk_sequence(s.slot), walk_index(s.slot), SHADOW_KEY + walk_round(s.slot), push.key.seed);
            outcome = ratio_tracking(m, key, scale, walk, iterations, state.transmittance);
            COUNT_MEDIUM(density_lookups, walk.nulls)
            float reached = resumed_start(state.start, walk.entry + walk.t);
            // The search that goes on from the surface itself would miss it.
            outcome = outcome == GRID_STOPPED && reached >= state.hit.t ? GRID_LEFT : outcome;
            state.start = outcome == GRID_STOPPED ? reached : state.start;
        }
    }
    // A solid that absorbs has no medium inside, whose walk could stop: this is the whole way through it.
    if (HAS_ABSORPTION && crossing.interior != OUTSIDE && outcome == GRID_LEFT && state.transmittance != vec3(0.0)) {
        count_quarters(1u);
        state.transmittance *= transmittance(load_material(crossing.interior).absorption, max(state.hit.t - state.start, 0.0) * scale);
    }
    bool ended = outcome == GRID_LEFT && (!met || state.transmittance == vec3(0.0));
    if (!ended) {
        if (outcome == GRID_LEFT) {
            state.start = past_surface(state.hit.t);
            state.interior = crossing.beyond;
        }
        state.hit = no_hit(s.t_max);
    }
    return ended;
}

// Of a place that is left for later only the state is stored that it begins with.
void trace_shadow_rays_through_media(uint queue_place, uint from, bool begun) {
    uint resume = RESUMES ? from : INDEX_START;
    // The place, and the flags of four places.
    count_fetches(2u, 1u + FLAGS_PER_TEXEL);
    uint place = texelFetch(walk_waiting_queue_in, int(queue_place)).x;
    uint rays = texelFetch(walk_flags_in, int(place / FLAGS_PER_TEXEL))[place % FLAGS_PER_TEXEL] & (FLAG_AIRLIGHT | FLAG_SAMPLED);
    if (RESUMES) {
        rays = walk_shadow_states[queue_place].rays;
    }
    ShadowRay s = first_ray(place, rays);
    ShadowState state = begin_ray(place, rays, s.t_max, 0u);
    if (RESUMES) {
        state = walk_shadow_states[queue_place];
    }
    begin_candidates(s.slot, s.bounce, CANDIDATES_SHADOW);
    bool stopped = !begun;
    uint iterations = GRID_WALK_QUOTA;
    uint surfaces = HAS_ALPHA ? SHADOW_SURFACES_ALPHA : SHADOW_SURFACES;
    for (uint surface = 0u; surface < surfaces && state.rays != 0u && !stopped; ++surface) {
        resume = closest_hit(Ray(s.origin, search_start(state.start), s.direction, s.t_max), resume, state.hit);
        stopped = resume != INDEX_FINISHED;
        if (!stopped) {
            resume = INDEX_START;
            uint outcome;
            if (pass_surface(s, state, iterations, outcome)) {
                if (state.transmittance != vec3(0.0)) {
                    walk_gathered[s.slot].radiance += s.contribution * state.transmittance;
                }
                rays = state.rays & (state.rays - 1u);
                if (rays != 0u) {
                    COUNT_MEDIUM(second_rays, 1u)
                    s = first_ray(place, rays);
                    state = begin_ray(place, rays, s.t_max, state.grid_walks);
                }
                state.rays = rays;
            }
            stopped = outcome == GRID_STOPPED;
        }
    }
    if (state.rays == 0u) {
        walk_resume[queue_place] = INDEX_FINISHED;
        return;
    }
    walk_resume[queue_place] = resume;
    walk_shadow_states[queue_place] = state;
    stall_place(STALLED_SHADOW, begun);
}

#endif
