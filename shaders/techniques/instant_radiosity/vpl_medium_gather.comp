#version 460
// Radiance from the virtual lights of a pass in scenes with media: where eye paths have arrived at surfaces that scatter into more than one direction, or where
// they collide on the way there. From all lights, on surfaces and at collisions, with a shadow ray that passes boundaries and brings what the media let through.
//
// Collisions are those of free flights of eye paths (techniques/path/path_medium.comp), by the same random numbers: a ray gathers at its collision or at its surface, never at both,
// with the weight that flights have; one that stops in a grid gathers where its path goes on. Shadow rays weigh homogeneous media in closed form and grids by ratio tracking. Beyond the bound of the geometry term the light is the eye paths' own, whose ways go on.
//
// An invocation is for a place, and takes the lights in their order, so many stretches of shadow rays a dispatch. A place that has not had all of them, or whose ray a quota
// stops, notes where it is, marks itself and stalls the wave; further dispatches go on there, as in vpl_gather.comp.
//
// CL-VPL-MEDIA: A. Keller, "Instant Radiosity", 1997, in media; T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", 2006.
// Deterministic: a path's sum has the order of the lights.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "walk/wave.glsl"
#include "transport/path_set.glsl"
#include "walk/media.glsl"
#include "walk/medium_ray_state.glsl"
#include "wide_counter.glsl"

layout(constant_id = 22) const bool HAS_AIRLIGHT = true;  // eye paths take equi-angular samples
layout(constant_id = 45) const uint LIGHTS_AT_ONCE = 1u;  // stretches of shadow rays of a place, in a dispatch

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint states;         // of a path that gathers where it is scattered, a bit each
    vec3 scene_upper;
    uint least_bounces;  // scatterings in all
    WalkKey key;
    uint most_bounces;
    uint lights;
    float scale;         // one over the walks of the pass
    float edge_bound;    // of EDGE_BOUND
    uint seed;           // of the pass
    uint first_place;
    uint goes_on;        // 1 for places that have stopped
    uint surrounding;    // index of the medium outside all bodies, or NO_MEDIUM
} push;

// What a place has had of the lights, where it goes on.
struct MediumGatherState {
    vec3 sum;
    uint light;     // the next one, or whose ray is under way
    MediumRay ray;
    uint begun;     // 1 where a ray is under way
};

layout(set = 3, binding = 0) uniform utextureBuffer virtual_light_texels;
layout(set = 3, binding = 1, scalar) restrict buffer MediumGatherStates { MediumGatherState medium_gather_states[]; };  // by place
layout(set = 3, binding = 3, scalar) restrict readonly buffer LightDepartures { float departures[]; };  // path_departures, by slot
// As in scene/media_bindings.glsl.
layout(set = 3, binding = 4) uniform utextureBuffer media_records;
layout(set = 3, binding = 5) uniform textureBuffer media_densities;
layout(set = 3, binding = 6) uniform textureBuffer media_majorants;
#define CLERESTORY_MEDIA_BOUND

#include "techniques/instant_radiosity/medium_connection.glsl"
#include "techniques/instant_radiosity/gather_progress.glsl"
#include "walk/draws.glsl"
#include "transport/media_tracking.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"
#include "walk/medium_ray.glsl"

// Tells the walks of these rays through grids from those of the paths' own.
const uint RATIO_SEED = 0x76706c74u;

// What virtual lights leave to be gathered at a distance of t from where the path was scattered last, whose light they have up to the bound.
float gathered_share(uint slot, WalkState path, float cos_here, float t) {
    float cos_there = EDGE_BOUND == EDGE_GEOMETRY ? departures[slot] : 1.0;
    return share_beyond(EDGE_BOUND, push.edge_bound, path.pdf, cos_there, cos_here, t * t);
}

// The walk of an eye path's ray through a grid, as path_medium.comp has it: with the same stops, where the path goes on with a way of its own.
uint track_path(SceneMedium m, uint slot, WalkState path, uint dimension, bool passes, bool airlit, float end, MediumState at, inout vec3 weight,
                out float t) {
    uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), dimension, push.key.seed);
    GridWalk walk = begin_grid_walk(m, path.origin, path.direction, at.start, end);
    bool cut = false;
    if (airlit) {
        float longest = AIRLIGHT_DEPTH / (m.majorant * m.density_max);
        cut = walk.t_end > longest;
        walk.t_end = min(walk.t_end, longest);
    }
    vec3 emitted = vec3(0.0);
    uint outcome = delta_tracking(m, key, vec3(0.0), passes, walk, at.bands, weight, emitted);
    t = walk.entry + walk.t;
    outcome = cut && outcome == GRID_LEFT ? GRID_STOPPED : outcome;
    return outcome == GRID_STOPPED && resumed_start(at.start, t) >= end ? GRID_LEFT : outcome;
}

// Prepares the receiver of a place; false where nothing is gathered.
bool begin_receiver(uint slot, uint place, out MediumReceiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    uint state = HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u;
    r.at.bounce = HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce;
    // A light and the receiver scatter once more each.
    if ((push.states >> state & 1u) == 0u || (COUNTS_BOUNCES && r.at.bounce + 2u > push.most_bounces)) {
        return false;
    }
    MediumState at = MediumState(vec3(1.0 / 3.0), 0.0);
    if (status.rounds > 0u) {
        at = walk_medium_states[slot];
    }
    bool met = hit.triangle != NO_HIT;
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (met) {
        crossing = cross_surface(hit.triangle, path.direction, walk_gathered[slot].interior);
    }
    float end = met ? max(hit.t, at.start) : FAR_AWAY;
    vec3 weight = vec3(1.0);
    r.medium = NO_MEDIUM;
    r.at.interior = crossing.interior;
    uint medium = medium_inside(crossing.interior, push.surrounding);
    if (medium != NO_MEDIUM && end > at.start) {
        SceneMedium m = load_medium(medium);
        bool passes = m.sigma_s == vec3(0.0);
        uint outcome = GRID_LEFT;
        float t = 0.0;
        uint dimension = DIMENSION_FIRST_MEDIUM + DIMENSIONS_PER_WAY * walk_round(slot);
        if (HAS_HOMOGENEOUS && !(HAS_GRIDS && m.has_grid != 0u)) {
            float t_max = end >= FAR_AWAY ? FAR_AWAY : end - at.start;
            if (passes) {
                weight = transmittance(m.sigma_t, t_max);
            } else {
                Sampler s = walk_sampler(slot, dimension);
                FreeFlight flight = sample_free_flight(m.sigma_s, m.sigma_t, at.bands, t_max, sample_2d(s));
                weight = flight.weight;
                outcome = flight.collides ? GRID_COLLIDED : GRID_LEFT;
                t = at.start + flight.t;
            }
        } else if (HAS_GRIDS) {
            uint scattered = r.at.bounce + 1u;
            bool airlit = HAS_AIRLIGHT && !passes && is_open(crossing.interior) && scattered >= push.least_bounces && scattered <= push.most_bounces;
            outcome = track_path(m, slot, path, dimension, passes, airlit, end, at, weight, t);
        }
        if (outcome == GRID_STOPPED) {
            return false;
        }
        if (outcome == GRID_COLLIDED) {
            t = max(t, 0.0);
            r.medium = medium;
            r.at.arrival.surface.point = SurfacePoint(path.origin + t * path.direction, vec3(0.0));
            r.at.arrival.wo = -path.direction;
            r.at.throughput = path.throughput * weight * gathered_share(slot, path, 1.0, t);
            return r.at.throughput != vec3(0.0);
        }
    }
    if (!met || crossing.boundary) {
        return false;
    }
    r.at.arrival = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(r.at.arrival) || !arrival_has_rough_lobes(r.at.arrival)) {
        return false;
    }
    if (HAS_ABSORPTION && crossing.interior != OUTSIDE) {
        weight *= exp(-load_material(crossing.interior).absorption * (end - max(at.start, 0.0)));
    }
    r.at.interior = arrival_interior(r.at.arrival, crossing.interior);
    float cos_here = abs(dot(path.direction, r.at.arrival.surface.geometric_normal));
    r.at.throughput = path.throughput * weight * gathered_share(slot, path, cos_here, hit.t);
    r.at.frame = scattering_frame(r.at.arrival, arrival_normal(r.at.arrival));
    return r.at.throughput != vec3(0.0);
}

// Goes on with the lights of a place.
void gather(MediumReceiver r, inout MediumGatherState at, out uint rays) {
    rays = 0u;
    bool stopped = false;
    for (uint stretch = 0u; stretch < LIGHTS_AT_ONCE && at.light < push.lights && !stopped; ++stretch) {
        MediumLight l = load_medium_light(at.light);
        ShadowWay shadow;
        vec3 found = medium_connection(r, l, shadow);
        found = counts_bounces(r.at.bounce + l.light.bounce + 2u) ? found : vec3(0.0);
        bool ended = found == vec3(0.0);
        if (!ended) {
            if (at.begun == 0u) {
                ++rays;
                at.begun = 1u;
                at.ray = begin_medium_ray(shadow);
            }
            if (HAS_ALPHA) {
                candidate_key = connection_words(r.at, at.light, LIGHT_RAY_SEED);
            }
            stopped = !search_stretch(shadow.ray, at.ray);
            if (!stopped) {
                ended = pass_stretch(shadow.ray, push.surrounding, connection_words(r.at, at.light, RATIO_SEED), at.ray);
                at.sum += ended ? found * at.ray.transmittance : vec3(0.0);
            }
        }
        if (ended) {
            at.begun = 0u;
            ++at.light;
        }
    }
}

void main() {
    uint place = push.first_place + gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    bool goes_on = push.goes_on != 0u;
    uint resume = walk_resume[place];
    if (goes_on ? resume != LIGHTS_STOPPED : resume == LIGHTS_STOPPED || resume == LIGHTS_DONE) {
        return;
    }
    if (!goes_on && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = LIGHTS_DONE;
    uint slot = load_slot(place);
    MediumReceiver r;
    if (!begin_receiver(slot, place, r)) {
        count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
        return;
    }
    MediumGatherState at =
        MediumGatherState(vec3(0.0), 0u, MediumRay(vec3(1.0), INDEX_START, no_hit(0.0), 0.0, OUTSIDE, 0u), 0u);
    if (goes_on) {
        at = medium_gather_states[place];
    } else {
        atomicAdd(gather_counters.gathers, 1u);
    }
    uint first = at.light;
    uint rays;
    gather(r, at, rays);
    COUNT_WIDE(gather_counters.connections, at.light - first)
    COUNT_WIDE(gather_counters.shadow_rays, rays)
    if (!goes_on) {
        count_work(index_iterations + GRID_ITERATION_WORK * grid_iterations + CONNECTION_ITERATIONS * LIGHTS_AT_ONCE, WORK_UNIT);
    }
    if (at.light == push.lights) {
        walk_gathered[slot].radiance += r.at.throughput * at.sum * push.scale;
        return;
    }
    medium_gather_states[place] = at;
    walk_resume[place] = LIGHTS_STOPPED;
    if (goes_on) {
        atomicAdd(gather_counters.remaining, 1u);
    } else {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
