#version 460
// Photons on their way through media: free flight to a collision, where it is stored and scattered, or absorbed; on through a boundary; or with what is left
// of it to the surface, for photon_scatter.comp. Or, of media that are seen by beams, whole ways, or as much of them as a flight (SHORT_WAYS); or by planes, two flights as well.
//
// Free flights are those of eye paths (transport/medium.glsl, transport/media_tracking.glsl): analytic in homogeneous media, delta tracking in grids, one walk
// for all bands. A collision stores the flux that it scatters; the photon goes on with the probability that leaves its largest band as it is. Where a medium
// scatters nothing there are no collisions, and light is weighted by the transmittance instead.
//
// Where kernels follow footprints these pass and scatter with the photon (photon_footprint.glsl); in grids what has passed is reckoned from the bounds of the density.
//
// PM-PH-1, PM-PD-9 to PM-PD-12: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 3.4.1.3 and 7.2.3; H. W. Jensen and P. H. Christensen, "Efficient Simulation of
// Light Transport in Scenes with Participating Media Using Photon Maps", 1998; B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light
// Transport", 2017. Deterministic in (seed, pass, photon).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_features.glsl"
#define CLERESTORY_GRID_BOUNDS HAS_DIFFERENTIALS

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/photon_mapping/photon_footprint.glsl"
#include "techniques/photon_mapping/photon_volume.glsl"
#include "transport/path_set.glsl"
#include "transport/photon_share.glsl"
#include "walk/media.glsl"

layout(constant_id = 61) const bool SHORT_WAYS = false;  // ways end by chance

layout(push_constant, scalar) uniform Push {
    WalkKey key;         // the sequence is the pass, places in it photons
    uint surrounding;    // index of the medium outside all bodies, or NO_MEDIUM
    uint last_bounce;    // greatest number of scatterings before a collision that is stored
    uint first_deposit;  // least
    float flux_scale;    // of fluxes as they are stored
    float piece;         // about how long pieces of ways are, m
    uint pieces_most;    // of a way
    uint classes[2];     // successors of each class of photons by scattering in a medium
    float plane_share;   // of ways that have planes
    float body_reach;    // no two places of a body are farther apart, m
    float path_share;    // of kernels' radii over the mean free path of their medium at its densest, at most; 0 for any
    EventKernelSettings kernel;  // without footprints all have the greatest radius
} push;

#include "walk/draws.glsl"
#include "techniques/photon_mapping/photon_flux.glsl"
#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "transport/phase.glsl"
#include "walk/survival.glsl"

// Optical depth beyond which what is left of a way is not stored: a ten millionth of its light.
const float WAY_DEPTH = 16.0;
// Stands for the round in the key of the random numbers of planes.
const uint PLANE_KEY = 0x80000000u;
// Of PATH_SET_STATE_BITS each.
const uint CLASSES_PER_WORD = 8u;

// What a collision's kernel and the next footprint are made of.
struct Footprint {
    float across;  // m2
    float pdf;     // of the collision on the way, 1/m
    float here;    // extinction there, of what photons collide with, 1/m
    float most;    // the same at the greatest density
};

// A radius, no more than its share of the medium's mean free path.
float radius_in(SceneMedium m, float radius) {
    float densest = largest_component(m.sigma_t) * (HAS_GRIDS && m.has_grid != 0u ? m.density_max : 1.0);
    return push.path_share > 0.0 ? min(radius, push.path_share / densest) : radius;
}

// What a record has of the photon's light: its squared distance from the first scattering, m2, or 0.
float recorded_light_distance2(WalkState photon) { return CARRIES_LIGHT_DISTANCE && path_set_bounce(photon.bounce) > 0u ? photon.pdf : 0.0; }

// What a plane's record tells of the photon's light (distance2_in_plane), whose first flight begins at `start` of the photon's way and turns into that direction.
float told_of_light(WalkState photon, SceneMedium m, float start, vec3 turned) {
    if (!CARRIES_LIGHT_DISTANCE || path_set_bounce(photon.bounce) > 0u) {
        return recorded_light_distance2(photon);
    }
    // Never 0, by which light is told that eye paths do not find.
    return photon.pdf > 0.0 ? evened_distance2(photon.pdf, phase_function(m.phase, m.phase_parameter, photon.direction, turned))
                            : -max(start, NORMAL_MIN);
}

// Stores the photon's way through a homogeneous medium, `reach` long.
uint deposit_way(uint slot, uint place, WalkState photon, uint medium, SceneMedium m, float start, float reach) {
    uint bounce = path_set_bounce(photon.bounce);
    reach = min(reach, WAY_DEPTH / least_extinction(m.sigma_t));
    uint pieces = uint(clamp(ceil(reach / push.piece), 1.0, float(push.pieces_most)));
    atomicAdd(photon_medium_counters.events, pieces);
    PhotonWay way;
    way.start = photon.origin + start * photon.direction;
    way.reach = reach;
    way.direction = photon.direction;
    way.medium = medium;
    way.flux = dithered_flux(photon.throughput * push.flux_scale, slot, bounce);
    way.bounce = HAS_CLASSES ? path_set_state(photon.bounce) : bounce;
    way.sigma_t = SHORT_WAYS ? short_way_extinction(m.sigma_s, m.sigma_t) : m.sigma_t;
    way.pieces = pieces;
    way.light2 = recorded_light_distance2(photon);
    photon_ways[place] = way;
    return FLAG_WAITING | FLAG_VOLUME;
}

// State of a photon after a scattering in a medium; PATH_SET_DEAD where no picture has that.
uint state_after(uint state) {
    if (HAS_CLASSES) {
        return push.classes[state / CLASSES_PER_WORD] >> (PATH_SET_STATE_BITS * (state % CLASSES_PER_WORD)) & PATH_SET_DEAD;
    }
    return PHOTON_DIFFUSED;
}

// Distance of a flight through a homogeneous medium; the probability to come farther is a transmittance.
float flight(float extinction, uint bits) { return -log(1.0 - unit_float(bits)) / extinction; }

// Stores a record beside the way of a place.
uint store_beside(uint place, uvec4 q0, uvec4 q1, uvec4 q2) {
    photon_beside[WIDE_QUARTERS * place] = q0;
    photon_beside[WIDE_QUARTERS * place + 1u] = q1;
    photon_beside[WIDE_QUARTERS * place + 2u] = q2;
    return FLAG_WAITING | FLAG_BESIDE;
}

// Stores the photon's flight along its way, `reach` long, and one into a direction that it may be scattered in, however far the photon itself comes. Both end by chance, as
// in the band that comes farthest: what other bands have less of is a query's. In a body the second one has an end, beyond which nothing of the body lies.
uint deposit_plane(uint slot, uint place, WalkState photon, uint medium, SceneMedium m, float start, float reach, bool in_body) {
    uint history = path_set_bounce(photon.bounce) + 1u;
    if (HAS_CLASSES) {
        history = state_after(path_set_state(photon.bounce));
    }
    uvec4 flights = pcg4d(uvec4(walk_sequence(slot), walk_index(slot), PLANE_KEY + walk_round(slot), push.key.seed));
    uvec4 turn = pcg4d(flights);
    if (HAS_CLASSES && history == PATH_SET_DEAD || !(unit_float(turn.x) < push.plane_share)) {
        return 0u;
    }
    float extinction = plane_extinction(m.sigma_s, m.sigma_t);
    float far = flight(extinction, flights.y);
    float c = phase_function_sample(m.phase, m.phase_parameter, unit_float(turn.y));
    PhotonPlane plane;
    plane.start = photon.origin + start * photon.direction;
    plane.first = min(reach, flight(extinction, flights.x)) * photon.direction;
    vec3 turned = normalize(phase_direction(photon.direction, c, unit_float(turn.z)));
    plane.second = (in_body ? min(far, push.body_reach) : far) * turned;
    plane.flux = dithered_flux(photon.throughput * push.flux_scale, slot, path_set_bounce(photon.bounce));
    plane.medium = medium;
    plane.bounce = history;
    plane.light = told_of_light(photon, m, start, turned);
    uvec4 q0;
    uvec4 q1;
    uvec4 q2;
    pack_plane(plane, q0, q1, q2);
    if (!is_plane(q2)) {
        return 0u;
    }
    atomicAdd(photon_medium_counters.events, 1u);
    return store_beside(place, q0, q1, q2);
}

// Stores a collision at `at`, after which the photon has the flux that is scattered, with the flight that it ends where ways are stored, too.
uint deposit(uint slot, uint place, WalkState photon, uint medium, vec3 at, float radius, float flight) {
    atomicAdd(photon_medium_counters.events, 1u);
    uint bounce = path_set_bounce(photon.bounce);
    uint history = HAS_CLASSES ? path_set_state(photon.bounce) : bounce;
    uvec4 q0;
    uvec4 q1;
    vec3 flux = dithered_flux(photon.throughput * push.flux_scale, slot, bounce);
    pack_event(PhotonEvent(at, photon.direction, flux, radius, medium, history), q0, q1);
    if (STORES_POINTS) {
        return store_beside(place, q0, q1, pack_flight(flight, recorded_light_distance2(photon), POINT_RECORD));
    }
    store_waiting(place, q0, q1, uvec4(0u));
    return FLAG_WAITING | FLAG_VOLUME;
}

// The photon's new direction at a collision, which has left `photon.throughput` of what there was `before`; false when it ends.
bool scatter(uint slot, SceneMedium m, vec3 before, vec3 at, Footprint f, inout WalkState photon) {
    uint bounce = path_set_bounce(photon.bounce);
    if (bounce >= push.last_bounce) {
        return false;
    }
    uint after = state_after(path_set_state(photon.bounce));
    if (HAS_CLASSES && after == PATH_SET_DEAD) {
        return false;
    }
    float survival = walk_survival(before, photon.throughput, bounce);
    // Also ends a photon whose flux is not a number.
    if (!(bounce_sample(slot, bounce, DIMENSION_SIDE).y < survival)) {
        return false;
    }
    vec2 u = bounce_sample(slot, bounce, DIMENSION_DIRECTION);
    float c = phase_function_sample(m.phase, m.phase_parameter, u.x);
    vec3 wi = normalize(phase_direction(photon.direction, c, u.y));
    if (HAS_DIFFERENTIALS) {
        float phase = phase_function(m.phase, m.phase_parameter, photon.direction, wi);
        photon_medium_differentials[slot] = scattered_in_medium(f.across, f.pdf, f.here, survival, wi, phase);
    }
    if (CARRIES_LIGHT_DISTANCE) {
        photon.pdf = carried_distance2(photon.pdf, bounce, distance(photon.origin, at), true);
        if (STORES_PLANES && bounce == 0u) {
            photon.pdf = evened_distance2(photon.pdf, phase_function(m.phase, m.phase_parameter, photon.direction, wi));
        }
    }
    photon.direction = wi;
    photon.origin = at;
    photon.throughput /= survival;
    if (STORES_PLANES) {
        photon.eta_scale = PHOTON_FROM_COLLISION;
    }
    photon.bounce = path_set_joined(bounce + 1u, after);
    return true;
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
    WalkState photon = load_walk(slot);
    MediumState state = MediumState(vec3(1.0 / 3.0), 0.0);
    if (status.rounds > 0u) {
        state = walk_medium_states[slot];
    }
    Hit hit = load_hit(place);
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, photon.direction, walk_gathered[slot].interior);
    }
    float end = hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, state.start);
    uint medium = medium_inside(crossing.interior, push.surrounding);
    vec3 weight = vec3(1.0);
    uint outcome = GRID_LEFT;
    uint flags = 0u;
    SceneMedium m;
    float t = 0.0;  // of a collision, or of a stop, along the ray
    float passed = 1.0;  // share of photons that come as far, of those that began the way
    Footprint f = Footprint(0.0, 0.0, 0.0, 0.0);
    if (medium != NO_MEDIUM && end > state.start) {
        m = load_medium(medium);
        bool passes = m.sigma_s == vec3(0.0);
        uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot);
        bool has_way = !(HAS_GRIDS && m.has_grid != 0u);
        if (STORES_WAYS && has_way && !passes && photon.throughput != vec3(0.0)) {
            float begin = max(state.start, 0.0);
            float reach = end >= FAR_AWAY ? FAR_AWAY : end - begin;
            // What comes of a way that begins at a collision is that of the plane of the way before.
            bool in_plane = STORES_PLANES && photon.eta_scale == PHOTON_FROM_COLLISION;
            if (path_set_bounce(photon.bounce) >= push.first_deposit && !in_plane) {
                float shown = reach;
                if (SHORT_WAYS) {
                    // By the number of the photon's own flight: where bands are alike the way ends where that does.
                    uint word = sampler_bits(walk_sampler(slot, dimension)).x;
                    shown = min(reach, flight(plane_extinction(m.sigma_s, m.sigma_t), word));
                }
                flags = deposit_way(slot, place, photon, medium, m, begin, shown);
            }
            if (STORES_PLANES && path_set_bounce(photon.bounce) < push.last_bounce) {
                flags |= deposit_plane(slot, place, photon, medium, m, begin, reach, crossing.interior != OUTSIDE);
            }
        }
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            float t_max = end >= FAR_AWAY ? FAR_AWAY : end - state.start;
            if (passes) {
                weight = transmittance(m.sigma_t, t_max);
            } else {
                Sampler s = walk_sampler(slot, dimension);
                FreeFlight flight = sample_free_flight(m.sigma_s, m.sigma_t, state.bands, t_max, sample_2d(s));
                if (HAS_DIFFERENTIALS) {
                    f.pdf = collision_density(m.sigma_t, state.bands, flight.t);
                    f.here = dot(flight.bands, m.sigma_t);
                    f.most = f.here;
                    passed = dot(state.bands, transmittance(m.sigma_t, flight.t));
                }
                weight = flight.weight;
                state.bands = flight.bands;
                outcome = flight.collides ? GRID_COLLIDED : GRID_LEFT;
                t = state.start + flight.t;
            }
        } else if (HAS_GRIDS) {
            uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
            GridWalk walk = begin_grid_walk(m, photon.origin, photon.direction, state.start, end);
            vec3 emitted = vec3(0.0);
            vec3 bands = state.bands;
            outcome = delta_tracking(m, key, vec3(0.0), passes, walk, state.bands, weight, emitted);
            if (HAS_DIFFERENTIALS && !passes) {
                float density = outcome == GRID_COLLIDED ? grid_density(m, walk) : 0.0;
                f.pdf = density * collision_density(m.sigma_t, bands, m.tightness * walk.bound);
                f.here = density * dot(state.bands, m.sigma_t);
                f.most = m.density_max * dot(state.bands, m.sigma_t);
                passed = dot(bands, transmittance(m.sigma_t, m.tightness * walk.bound));
            }
            t = walk.entry + walk.t;
            float reached = resumed_start(state.start, t);
            // The search that goes on from the surface itself would miss it.
            outcome = outcome == GRID_STOPPED && reached >= end ? GRID_LEFT : outcome;
            t = outcome == GRID_STOPPED ? reached : t;
            COUNT_MEDIUM(null_collisions, walk.nulls)
            COUNT_MEDIUM(density_lookups, walk.nulls + (outcome == GRID_COLLIDED ? 1u : 0u))
            count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
        }
        COUNT_MEDIUM(collisions, outcome == GRID_COLLIDED ? 1u : 0u)
    }
    if (HAS_ABSORPTION && crossing.interior != OUTSIDE && outcome == GRID_LEFT) {
        weight *= exp(-load_material(crossing.interior).absorption * (end - max(state.start, 0.0)));
    }
    bool handled = true;
    bool alive = false;
    uint interior = crossing.interior;
    vec3 before = photon.throughput;
    photon.throughput *= weight;
    if (outcome == GRID_COLLIDED) {
        if (photon.throughput != vec3(0.0)) {
            // What lies before the ray's origin is moved there, so that it stays on the right side of the surface that the ray left.
            vec3 at = photon.origin + max(t, 0.0) * photon.direction;
            float radius = push.kernel.length_max;
            if (HAS_DIFFERENTIALS) {
                f.across = footprint_across(photon_medium_differentials[slot], t, photon.direction);
                radius = event_radius(push.kernel, f.across, f.pdf, f.most);
            }
            bool stores = (!STORES_WAYS || STORES_POINTS) && path_set_bounce(photon.bounce) >= push.first_deposit;
            if (stores) {
                flags |= deposit(slot, place, photon, medium, at, radius_in(m, radius), t - max(state.start, 0.0));
            }
            alive = scatter(slot, m, before, at, f, photon);
            state.start = 0.0;
        }
    } else if (outcome == GRID_STOPPED) {
        state.start = t;
        alive = photon.throughput != vec3(0.0);
    } else if (crossing.boundary) {
        state.start = past_surface(hit.t);
        if (STORES_PLANES) {
            photon.eta_scale = PHOTON_FROM_ELSEWHERE;
        }
        interior = crossing.beyond;
        alive = photon.throughput != vec3(0.0);
    } else {
        handled = false;
    }
    if (HAS_DIFFERENTIALS && outcome != GRID_COLLIDED) {
        photon_medium_differentials[slot] = passed_differentials(photon_medium_differentials[slot], passed);
    }
    walk_gathered[slot].interior = interior;
    walk_medium_states[slot] = state;
    walk_medium_events[place] = MediumEvent(weight, flags | (handled ? EVENT_HANDLED : 0u));
    if (handled) {
        walk_flags_out[place] = flags | (alive ? FLAG_ALIVE : 0u);
        if (alive) {
            walk_states_out[slot] = photon;
        } else {
            atomicAdd(photon_medium_counters.absorbed, 1u);
        }
    }
}
