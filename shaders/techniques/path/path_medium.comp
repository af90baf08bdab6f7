#version 460
// Wavefront path tracer: what happens in the medium on the way to the surface that a ray has met. Free flight to a collision, light sampled
// and a direction chosen there; or on through a boundary; or the weight with which the path arrives at the surface, for path_shade.comp.
//
// BG-1, BG-3, BG-4, PM-F-3: volumetric path tracing by analytic free flight (homogeneous media) and delta tracking (grids); methods and
// sources in transport/medium.glsl and transport/media_tracking.glsl. Emission of homogeneous media is integrated along the way in closed
// form, that of grids is collected at tentative collisions. Light of points, spots and points of area lights is also sampled equi-angularly
// where that helps, combined by the power heuristic. Unbiased. Light from infinity does not pass an endless medium that extinguishes.
// Where photons have the same light (SHARES), paths have the rest of what is scattered more than once, the last time, from the light on, here; of what is scattered twice at last on one
// way through a body what planes leave, if there are some (SHARES_PLANES).
// Where other means have the light of edges between two scatterings up to a bound, collisions scatter what it leaves out, as surfaces do.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(constant_id = 22) const bool HAS_AIRLIGHT = true;  // equi-angular samples
#define CLERESTORY_GRID_BOUNDS HAS_AIRLIGHT

#include "walk/count_fetches.glsl"

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "transport/path_set.glsl"
#include "transport/photon_share.glsl"
#include "techniques/path/path_bounce.glsl"
#include "techniques/path/path_slots.glsl"
#include "walk/hand_on.glsl"
#include "walk/media.glsl"

#include "walk/draws.glsl"
#include "transport/edge_bound.glsl"
#include "transport/light_choice.glsl"
#include "transport/media_tracking.glsl"
#include "transport/bodies.glsl"
#include "transport/phase.glsl"

// The entries of path_even_distances and path_flights of the path under way.
float path_even_distance2 = 0.0;
PathFlight path_flight = PathFlight(vec3(0.0), 1.0);

// Squared distance of a light at which the path and photons each have half of what a place on its way scatters out of a direction.
float even_distance2_here(WalkState path, SceneMedium m, vec3 from) {
    // Photons come by the place, along the path's way and on towards the eye, with the path's own density where its way began: by a plane, if nothing but the medium is in between.
    bool by_plane = SHARES_PLANES && path_even_distance2 < 0.0 && path_flight.crossing != vec3(0.0);
    if (!by_plane) {
        return abs(path_even_distance2);
    }
    float across = across_of_planes(abs(dot(path_flight.crossing, from)), mean_extinction(m.sigma_t));
    // Never 0, which stands for paths that share nothing.
    return max(even_distance2_across(across, path.pdf, float(SHARING_PHOTONS) * push.edge_bound), NORMAL_MIN);
}

// Share of the path in light from that squared distance and direction that it scatters at a place of its way with a density.
float share_here(WalkState path, SceneMedium m, float phase, float light2, vec3 from) {
    if (path_even_distance2 == 0.0) {
        return 1.0;
    }
    return eye_share(SHARES_PLANES ? evened_distance2(light2, phase) : light2, even_distance2_here(path, m, from));
}

// Notes for what is found behind that the path is scattered into a direction with a density.
void note_scattering(WalkState path, SceneMedium m, vec3 wi, float phase) {
    vec3 crossing = cross(path.direction, wi);
    if (path_even_distance2 != 0.0) {
        path_even_distance2 = even_distance2_here(path, m, wi);
    } else if (SHARES_PLANES) {
        float across = across_of_beams(length(crossing), mean_extinction(m.sigma_t), push.beam_radius);
        path_even_distance2 = -max(even_distance2_across(across, phase, float(SHARING_PHOTONS)), NORMAL_MIN);
        path_flight.crossing = crossing;
    } else {
        bool has_beams = !(HAS_GRIDS && m.has_grid != 0u);
        float extinction = mean_extinction(m.sigma_t);
        path_even_distance2 =
            -even_distance2(phase, length(crossing), extinction, push.edge_bound, push.beam_radius, float(SHARING_PHOTONS), has_beams);
    }
    path_flight.evenness = 4.0 * PI * phase;
}

// As in path_shade.comp.
layout(constant_id = 35) const uint EDGE_BOUND = EDGE_UNBOUNDED;

// The way from the path's start to the surface.
struct Way {
    float start;
    float end;
    uint interior;
};

// What lies before the ray's origin is moved there, so that it stays on the right side of the surface that the ray left.
vec3 place_on_way(WalkState path, Way way, float t) { return path.origin + max(way.start + t, 0.0) * path.direction; }

// Share of what a collision scatters, t from where the path was scattered last, that is the path's own beside those of other means: all where that was a mirror, or nowhere.
float own_share(uint slot, WalkState path, float t) {
    // There is no cosine at the collision.
    float cos_there = EDGE_BOUND == EDGE_GEOMETRY ? path_departures[slot] : 1.0;
    return share_beyond(EDGE_BOUND, push.edge_bound, path.pdf, cos_there, 1.0, t * t);
}

// Weight of light sampling of density `light_pdf` (0: of a light without extent) against the phase function's directions, which meet the light, too.
// Equi-angular samples and collisions share it: what directions find is weighted without regard to how their place was found.
float light_weight(float light_pdf, float phase) { return light_pdf > 0.0 ? power_heuristic(light_pdf, phase) : 1.0; }

ShadowRay shadow_ray(uint slot, WalkState path, vec3 from, vec3 to, vec3 contribution) {
    ShadowRay ray;
    ray.origin = from;
    ray.t_max = 1.0;
    ray.direction = to - from;
    ray.slot = slot;
    ray.contribution = contribution;
    ray.bounce = path.bounce + 1u;
    return ray;
}

// Iterations of a walk to an equi-angular sample: those, and through the blocks of a grid, at most 63 along each axis. With all of them a walk
// fails to arrive once in 10^150.
const uint AIRLIGHT_QUOTA = 512u;

// What equi-angular samples are taken of: the way, or the part of it that lies in the grid.
struct Segment {
    float start;
    float reach;  // FAR_AWAY: endless
};

// Whether light has points that samples can be taken of.
bool has_place(uint kind) {
    return (HAS_AREA_LIGHTS && kind == LIGHT_TRIANGLE) || (HAS_PUNCTUAL_LIGHTS && (kind == LIGHT_POINT || kind == LIGHT_SPOT));
}

// Where a light's point is by a segment. It has no range where samples are not worth their rays: whether they are depends on the segment and the
// point alone, so that it is the same for all ways to sample that point's light.
EquiAngular airlight_from(WalkState path, vec3 bands, SceneMedium m, Segment segment, GridWalk walk, vec3 light) {
    EquiAngular e = equi_angular(path.origin + segment.start * path.direction, path.direction, segment.reach, light);
    float density = 1.0;
    if (HAS_GRIDS && m.has_grid != 0u) {
        density = m.tightness * fetch_majorant(m, grid_block(m, walk, clamp(e.along, 0.0, segment.reach)));
    }
    e.range = equi_angular_helps(e, segment.reach, density * dot(bands, m.sigma_t)) ? e.range : 0.0;
    return e;
}

// Density of collisions that weights reckon with, per metre, t from the start of the segment. In grids, where it is not known, the transmittance of
// the bounds of the density stands in for it, these scaled by their tightness: each t has one value, which is all that unbiased weights need.
float reckoned_collision_density(SceneMedium m, vec3 bands, float t, GridWalk walk) {
    if (HAS_GRIDS && m.has_grid != 0u) {
        return grid_density(m, walk) * collision_density(m.sigma_t, bands, m.tightness * walk.bound);
    }
    return collision_density(m.sigma_t, bands, t);
}

// Light scattered once on the way, at a place chosen by the angle under which a point of a light sees it (Kulla and Fajardo 2012, 4.1 and 4.2).
// True where there is some.
bool sample_airlight(uint slot, uint place, WalkState path, vec3 bands, SceneMedium m, uint interior, Segment segment, GridWalk walk) {
    uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot) + DIMENSION_AIRLIGHT;
    uvec2 word = sampler_bits(walk_sampler(slot, dimension));
    uint place_word = word.y;
    LightChoice choice = choose_light_by_power(word, pcg3d(uvec3(word, 0u)).x);
    if (!has_place(choice.light.kind)) {
        return false;
    }
    if (HAS_AREA_LIGHTS && choice.light.kind == LIGHT_TRIANGLE) {
        place_word = sampler_bits(walk_sampler(slot, DIMENSION_FIRST_PLACE + walk_round(slot))).x;
    }
    LightPoint point = light_point(choice, word, push.scene_lower, push.scene_upper);
    EquiAngular e = airlight_from(path, bands, m, segment, walk, point.point.position);
    float t = equi_angular_sample(e, segment.reach, unit_float(place_word));
    float pdf = equi_angular_pdf(e, t);
    if (!(pdf > 0.0)) {
        return false;
    }
    vec3 from = path.origin + max(segment.start + t, 0.0) * path.direction;
    LightSample seen = light_seen(point, from);
    if (seen.radiance == vec3(0.0)) {
        return false;
    }
    vec3 scattered = m.sigma_s;
    vec3 passed = vec3(1.0);
    if (HAS_GRIDS && m.has_grid != 0u) {
        uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
        uint iterations = AIRLIGHT_QUOTA;
        walk.t_end = t;
        if (ratio_tracking(m, key, 1.0, walk, iterations, passed) != GRID_LEFT) {
            return false;
        }
        COUNT_MEDIUM(density_lookups, walk.nulls + 1u)
        scattered *= grid_density(m, walk);
    } else {
        passed = transmittance(m.sigma_t, t);
    }
    float phase = phase_function(m.phase, m.phase_parameter, path.direction, seen.direction);
    // Collisions choose the light for their place, these samples by its power.
    float gain = light_choice_gain(choice, LightReceiver(from, vec3(0.0)));
    float weight = light_weight(gain * seen.pdf, phase) * power_heuristic(pdf, gain * reckoned_collision_density(m, bands, t, walk));
    if (SHARES) {
        vec3 to = seen.point.position - from;
        weight *= share_here(path, m, phase, dot(to, to), seen.direction);
    }
    vec3 contribution = path.throughput * passed * scattered * seen.radiance * (phase * weight / pdf);
    if (EDGE_BOUND != EDGE_UNBOUNDED) {
        contribution *= own_share(slot, path, max(segment.start + t, 0.0));
    }
    if (contribution == vec3(0.0)) {
        return false;
    }
    ShadowRay ray = shadow_ray(slot, path, from, seen.point.position, contribution);
    shadow_segment(SurfacePoint(from, vec3(0.0)), vec3(0.0), seen.point, seen.normal, ray.origin, ray.direction);
    walk_airlight_rays[place] = ray;
    walk_shadow_starts[place].airlight_interior = interior;
    return true;
}

// Light that a collision at `from`, t from the start of the segment, scatters into the path. The flags of the place where there is some, or 0.
uint sample_collision_light(uint slot, uint place, WalkState path, vec3 bands, SceneMedium m, uint interior, vec3 from, float t, Segment segment,
                            GridWalk walk) {
    uvec2 word = bounce_words(slot, path.bounce, DIMENSION_LIGHT);
    LightSample light = sample_light(LightReceiver(from, vec3(0.0)), word, push.scene_lower, push.scene_upper);
    if (light.radiance == vec3(0.0)) {
        return 0u;
    }
    float phase = phase_function(m.phase, m.phase_parameter, path.direction, light.direction);
    float weight = light_weight(light.pdf, phase);
    if (HAS_AIRLIGHT && segment.reach > 0.0 && !light.infinite) {
        EquiAngular e = airlight_from(path, bands, m, segment, walk, light.point.position);
        if (e.range > 0.0) {
            float gain = HAS_LIGHT_TREE ? light.choice.probability / distribution_probability(0u, light.choice.index) : 1.0;
            weight *= power_heuristic(gain * reckoned_collision_density(m, bands, t, walk), equi_angular_pdf(e, t));
        }
    }
    if (SHARES) {
        vec3 to = light.point.position - from;
        float light2 = light.infinite ? placeless_distance2(push.scene_lower, push.scene_upper) : dot(to, to);
        weight *= share_here(path, m, phase, light2, light.direction);
    }
    ShadowRay ray = shadow_ray(slot, path, from, light.point.position, path.throughput * light.radiance * (phase * weight));
    if (light.infinite) {
        ray.t_max = FAR_AWAY;
        ray.direction = light.direction;
    } else {
        shadow_segment(SurfacePoint(from, vec3(0.0)), vec3(0.0), light.point, light.normal, ray.origin, ray.direction);
    }
    return store_shadow_ray(place, ray, interior, 0.0);
}

// The path's new direction at a collision; false when it ends.
bool scatter(uint slot, SceneMedium m, vec3 at, inout WalkState path) {
    float roulette = bounce_sample(slot, path.bounce, DIMENSION_SIDE).y;
    vec2 u = bounce_sample(slot, path.bounce, DIMENSION_DIRECTION);
    float c = phase_function_sample(m.phase, m.phase_parameter, u.x);
    vec3 wi = normalize(phase_direction(path.direction, c, u.y));
    float phase = phase_function(m.phase, m.phase_parameter, path.direction, wi);
    if (SHARES) {
        note_scattering(path, m, wi, phase);
    }
    path.pdf = phase;
    if (HAS_LIGHT_TREE) {
        path_receivers[slot] = LightReceiver(at, vec3(0.0));
    }
    if (EDGE_BOUND == EDGE_GEOMETRY) {
        path_departures[slot] = 1.0;
    }
    path.origin = at;
    path.direction = wi;
    path.bounce += 1u;
    return path_roulette(path, roulette) && path.throughput != vec3(0.0);
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    if (HAS_GRIDS) {
        if (walk_resume[place] == PLACE_SCATTERED) {
            return;
        }
        if (!has_work_left()) {
            leave_for_later(STALLED_SCATTER);
            return;
        }
        walk_resume[place] = PLACE_SCATTERED;
    }
    uint slot = load_slot(place);
    count_quarters(WALK_STATE_QUARTERS);
    WalkState path = load_walk(slot);
    uint automaton = 0u;
    if (HAS_PATH_AUTOMATON) {
        automaton = path_set_state(path.bounce);
        path.bounce = path_set_bounce(path.bounce);
    }
    MediumState state = MediumState(vec3(1.0 / 3.0), 0.0);
    if (status.rounds > 0u) {
        state = walk_medium_states[slot];
        if (SHARES) {
            path_even_distance2 = path_even_distances[slot];
        }
        if (SHARES_PLANES) {
            path_flight = path_flights[slot];
        }
    }
    Hit hit = load_hit(place);
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, path.direction, walk_gathered[slot].interior);
    }
    Way way = Way(state.start, hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, state.start), crossing.interior);
    uint medium = medium_inside(way.interior, push.surrounding);
    vec3 weight = vec3(1.0);
    vec3 emitted = vec3(0.0);
    uint flags = 0u;
    uint outcome = GRID_LEFT;
    SceneMedium m;
    float t = 0.0;  // of a collision, from the start of the way
    float reached = 0.0;  // by a walk that stopped
    // Without a reach where no equi-angular samples are taken.
    Segment segment = Segment(0.0, 0.0);
    GridWalk start_of_grid;
    GridWalk walk;
    vec3 bands = state.bands;
    bool counted = path_set_contains(push.path_set, path.bounce);
    bool scattering = path_set_continues(push.path_set, path.bounce) && (path_set_lobes(push.path_set) & LOBE_VOLUME) != 0u;
    uint after = 0u;  // state of the automaton after scattering in a medium
    if (HAS_PATH_AUTOMATON) {
        after = path_set_successor(push.successors[automaton], LOBE_VOLUME);
        counted = counted && (push.accepting >> automaton & 1u) != 0u;
        scattering = path_set_continues(push.path_set, path.bounce) && after != PATH_SET_DEAD;
    }
    bool lit = HAS_AREA_LIGHTS || HAS_ENVIRONMENT || HAS_PUNCTUAL_LIGHTS;
    bool lighting = lit && scattering && path_set_contains(push.path_set, path.bounce + 1u);
    lighting = lighting && (!HAS_PATH_AUTOMATON || (push.accepting >> after & 1u) != 0u);
    // Draws of the medium are numbered by the path's round, which is the number of its ways so far.
    uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot);
    if (medium != NO_MEDIUM && way.end > way.start) {
        count_quarters(medium_quarters() + (NUMBERED ? 1u : 0u));
        m = load_medium(medium);
        // Where collisions would only end the path, it goes on in proportion to the transmittance instead.
        bool passes = !scattering || m.sigma_s == vec3(0.0);
        bool airlit = HAS_AIRLIGHT && lighting && m.sigma_s != vec3(0.0) && is_open(way.interior);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            float t_max = way.end >= FAR_AWAY ? FAR_AWAY : way.end - way.start;
            if (m.emission != vec3(0.0)) {
                emitted = path.throughput * m.emission * vec3(attenuated_length(m.sigma_t.x, t_max), attenuated_length(m.sigma_t.y, t_max),
                                                              attenuated_length(m.sigma_t.z, t_max));
            }
            segment = Segment(way.start, airlit ? t_max : 0.0);
            if (passes) {
                weight = transmittance(m.sigma_t, t_max);
            } else {
                Sampler s = walk_sampler(slot, dimension);
                FreeFlight flight = sample_free_flight(m.sigma_s, m.sigma_t, bands, t_max, sample_2d(s));
                t = flight.t;
                weight = flight.weight;
                state.bands = flight.bands;
                outcome = flight.collides ? GRID_COLLIDED : GRID_LEFT;
            }
        } else if (HAS_GRIDS) {
            uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
            walk = begin_grid_walk(m, path.origin, path.direction, way.start, way.end);
            bool cut = false;
            if (airlit) {
                // Beyond, the way goes on as after a stop, with samples of its own.
                float longest = AIRLIGHT_DEPTH / (m.majorant * m.density_max);
                cut = walk.t_end > longest;
                walk.t_end = min(walk.t_end, longest);
            }
            segment = Segment(walk.entry, airlit ? max(walk.t_end, 0.0) : 0.0);
            start_of_grid = walk;
            outcome = delta_tracking(m, key, path.throughput, passes, walk, state.bands, weight, emitted);
            t = (walk.entry - way.start) + walk.t;
            outcome = cut && outcome == GRID_LEFT ? GRID_STOPPED : outcome;
            reached = resumed_start(way.start, walk.entry + walk.t);
            // The search that goes on from the surface itself would miss it.
            outcome = outcome == GRID_STOPPED && reached >= way.end ? GRID_LEFT : outcome;
            COUNT_MEDIUM(null_collisions, walk.nulls)
            COUNT_MEDIUM(density_lookups, walk.nulls + (outcome == GRID_COLLIDED ? 1u : 0u))
        }
        if (HAS_AIRLIGHT && segment.reach > 0.0
            && sample_airlight(slot, place, path, bands, m, way.interior, segment, start_of_grid)) {
            flags |= FLAG_AIRLIGHT | FLAG_WAITING;
        }
        if (HAS_GRIDS) {
            count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
        }
        COUNT_MEDIUM(collisions, outcome == GRID_COLLIDED ? 1u : 0u)
        if (counted && emitted != vec3(0.0)) {
            if (SHARES && path_even_distance2 > 0.0) {
                float light2 = placeless_distance2(push.scene_lower, push.scene_upper);
                emitted *= eye_share(SHARES_PLANES ? light2 / path_flight.evenness : light2, path_even_distance2);
            }
            walk_gathered[slot].radiance += emitted;
        }
    }
    if (HAS_ABSORPTION && way.interior != OUTSIDE && outcome == GRID_LEFT) {
        count_quarters(1u);
        weight *= exp(-load_material(way.interior).absorption * (way.end - max(way.start, 0.0)));
    }
    bool handled = true;
    bool alive = false;
    uint interior = way.interior;
    if (outcome == GRID_COLLIDED) {
        path.throughput *= weight;
        if (EDGE_BOUND != EDGE_UNBOUNDED) {
            path.throughput *= own_share(slot, path, max(way.start + t, 0.0));
        }
        if (path.throughput != vec3(0.0)) {
            vec3 at = place_on_way(path, way, t);
            if (lighting) {
                flags |= sample_collision_light(slot, place, path, bands, m, way.interior, at, t - (segment.start - way.start), segment, walk);
            }
            alive = scatter(slot, m, at, path);
            automaton = after;
            state.start = 0.0;
        }
    } else if (outcome == GRID_STOPPED) {
        path.throughput *= weight;
        state.start = reached;
        alive = path.throughput != vec3(0.0);
    } else if (crossing.boundary) {
        path.throughput *= weight;
        state.start = past_surface(hit.t);
        interior = crossing.beyond;
        path_flight.crossing = vec3(0.0);
        alive = path.throughput != vec3(0.0);
    } else {
        handled = false;
    }
    walk_gathered[slot].interior = interior;
    walk_medium_states[slot] = state;
    if (SHARES) {
        path_even_distances[slot] = path_even_distance2;
    }
    if (SHARES_PLANES) {
        path_flights[slot] = path_flight;
    }
    walk_medium_events[place] = MediumEvent(weight, (flags & FLAG_AIRLIGHT) | (handled ? EVENT_HANDLED : 0u));
    walk_flags_out[place] = flags | (alive ? FLAG_ALIVE : 0u);
    if (alive) {
        if (HAS_PATH_AUTOMATON) {
            path.bounce = path_set_joined(path.bounce, automaton);
        }
        walk_states_out[slot] = path;
    }
    add_fetches(FETCHES_MEDIUM);
}
