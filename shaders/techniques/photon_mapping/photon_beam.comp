#version 460
// Radiance from the volume map along eye paths' ways through media: beams of photons, each counting where the ray passes it, and planes, where the ray meets them; or events, by the beam estimate, each event whose kernel the ray pierces counting at its closest point; or the
// marched estimate, kernels of space at places of the ray that lie as far apart as they are wide, the first one by chance. Also what the medium leaves of light from the
// surface that the path has met, for the surface's query behind it.
//
// L = sum_j K(d_j / h_j) / h_j^2 tau(t_j) p(w_j, -v) Phi_j, with Phi_j the flux that the event scatters: the corrected units of the source, where the albedo stands
// instead of the scattering coefficient. Of beams L = sum_j K(d_j / h) / h tau(t_j) sigma_s p(w_j, -v) tau_j Phi_j / sin(w_j, v), with tau_j along the beam.
// Of planes L = sum_j tau(t_j) sigma_s^2 p(w_j', -v) tau_j' Phi_j / |v . (w_j x w_j')| with the directions w_j and w_j' of both flights, and tau_j' what is left there of other
// bands than the one that flights end as in: without blur. One of those that a ray meets has a ray that tells whether it is seen (photon_plane_ray.glsl).
// Where collisions are stored beside beams each has the share of the balance heuristic (point_share).
// Distances are measured from the eye, and the phase function is handed the way to the eye, -v. Transmittances are exact in homogeneous media. In a grid one delta tracking a ray finds how far light of each band comes; what lies before counts in
// full, what lies behind does not: unbiased. One that its quota stops goes on in a later dispatch, before anything is asked. Events count in their own medium alone.
//
// A ray's sum has the order of the map's leaves, or of its records. A query that its quota stops leaves nothing and goes through all records instead (LINEAR). A way that
// path_medium.comp goes through in several rounds is asked for once: `beam_asked` says how far.
//
// PM-VOL-5, PM-VOL-7: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 3.4.2.4 and 7.1; W. Jarosz, M. Zwicker and H. W. Jensen, "The Beam Radiance Estimate
// for Volumetric Photon Mapping", 2008; W. Jarosz, D. Nowrouzezahrai, I. Sadeghi and H. W. Jensen, "A Comprehensive Theory of Volumetric Radiance Estimation Using Photon
// Points and Beams", 2011; J. Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", 2014; B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light Transport", 2017. Deterministic in (seed, pixel, sample) and the map.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/photon_mapping/photon_event.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_eye.glsl"
#include "techniques/photon_mapping/photon_plane_ray.glsl"
#include "accel/sphere.glsl"

layout(constant_id = 42) const uint PROFILE = KERNEL_EPANECHNIKOV;
layout(constant_id = 43) const bool LINEAR = false;  // goes through records, for places that have stopped
layout(constant_id = 47) const bool MARCHES = false;
layout(constant_id = 55) const bool BEAMS = false;   // the map holds ways of photons
layout(constant_id = 56) const bool PLANES = false;  // and planes
layout(constant_id = 57) const bool POINTS = false;  // and collisions
const bool WIDE = PLANES || POINTS;

layout(set = 1, binding = 0) uniform utextureBuffer event_pairs;
layout(set = 1, binding = 1) uniform utextureBuffer event_records;
layout(set = 1, binding = 3, scalar) restrict buffer BeamCounters {
    uint queries;
    uint events[2];  // kernels that a ray pierced: 64 bits, the low word first
} beam_counters;
layout(set = 1, binding = 4, scalar) restrict buffer PhotonBeamWays { BeamWay beam_ways[]; };    // by place
layout(set = 1, binding = 5, scalar) restrict buffer PhotonBeamAsked { float beam_asked[]; };    // by slot; of scenes with grids
// Of maps with planes; elsewhere some other buffer is bound, and nothing is read or written. Rays of earlier bounces have ended.
layout(set = 1, binding = 6, scalar) restrict buffer PhotonPlaneRays { PlaneRay plane_rays[]; };

uvec4 compact_quarter(uint index) { return texelFetch(event_pairs, int(index)); }
uvec4 event_quarter(uint record, uint quarter) {
    return texelFetch(event_records, int((WIDE ? WIDE_QUARTERS : EVENT_QUARTERS) * record + quarter));
}
bool compact_visit_beam(uint record);

#define COMPACT_BEAM
#include "accel/compact_bvh.glsl"

layout(set = 1, binding = 2, scalar) restrict readonly buffer PhotonEventRoot { CompactRoot event_root; };

layout(push_constant, scalar) uniform Push {
    WalkKey key;
    uint surrounding;    // index of the medium outside all bodies, or NO_MEDIUM
    uint states;         // of a path that asks, in media or on surfaces, a bit each
    uint volume_states;  // of one that asks on its way through media
    uint least_bounces;  // scatterings in all, with that of the event
    uint most_bounces;
    float scale;         // of stored fluxes
    float radius;        // of beams, and of collisions beside them
    float plane_weight;  // of planes' fluxes, beside the scale
    uint first_place;    // of LINEAR
    uint first;          // of the records that a linear query goes through
    uint last;
    uint classes[ASKING_STATES];  // by state of a path: the classes of photons that count on surfaces, and 16 bits higher those that do in media
} push;

#include "walk/draws.glsl"
#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "transport/phase.glsl"
#include "walk/media.glsl"

// Stands for the round in the key of the random numbers, so that those of ways and shadow rays do not return.
const uint BEAM_KEY = 0x20000000u;
const uint PLANE_CHOICE_KEY = 0x10000000u;
// Places of a march within a kernel, at most: it is twice as wide as they lie apart.
const uint MARCH_PLACES = 3u;

// What the query under way is about.
struct Beam {
    vec3 origin;
    vec3 direction;
    float from;     // of the part that is asked for
    float to;
    float start;    // from where the medium takes from light
    vec3 reach;
    uint medium;
    SceneMedium m;
    uint classes;   // of photons that count, a bit each, where there are classes
    uint bounce;    // scatterings between the event and the eye
    float offset;   // of the places of a march, in their distance
    uvec4 choice;   // key of the choice among planes
    vec3 weight;    // of the light of planes, on its way to the picture
};
Beam beam;
vec3 gathered;
uint gathered_events;
PlaneRay chosen;  // among the planes so far

// What the medium leaves of light at a distance.
vec3 passed_to(float t) {
    if (HAS_GRIDS && beam.m.has_grid != 0u) {
        return vec3(lessThan(vec3(t), beam.reach));
    }
    return transmittance(beam.m.sigma_t, t - beam.start);
}

// Integral of kernel times transmittance along the ray by the march's places, of an event at a distance of t and a squared one of d2 from the ray.
vec3 marched(float t, float d2, float h) {
    float half_chord = sqrt(max(h * h - d2, 0.0));
    float first = ceil((t - half_chord - beam.start) / h - beam.offset);
    vec3 sum = vec3(0.0);
    for (uint i = 0u; i < MARCH_PLACES; ++i) {
        float at = beam.start + (first + float(i) + beam.offset) * h;
        float along = at - t;
        if (at > beam.from && at < beam.to) {
            sum += ball_profile(PROFILE, (d2 + along * along) / (h * h)) * passed_to(at);
        }
    }
    return sum / (h * h);
}

// Whether photons of this medium count here, with so many scatterings before the last one, or of this class.
bool counts_here(uint medium, uint history) {
    uint bounces = history + 1u + beam.bounce;
    bool counts = medium == beam.medium;
    if (HAS_CLASSES) {
        counts = counts && (beam.classes >> history & 1u) != 0u;
    }
    if (COUNTS_BOUNCES) {
        counts = counts && bounces >= push.least_bounces && bounces <= push.most_bounces;
    }
    return counts;
}

float share_of_points(float flight, float sine) {
    return point_share(mean_extinction(beam.m.sigma_t), flight, push.radius, push.radius, sine);
}

// Adds a beam's light where the ray passes it.
void add_beam(uvec4 q0, uvec4 q1, uvec4 q2) {
    PhotonBeam b = unpack_beam(q0, q1);
    vec3 way = b.end - b.start;
    float reach = length(way);
    if (reach > 0.0 && counts_here(b.medium, b.bounce)) {
        way /= reach;
        BeamMeeting at = meet_beam(beam.origin, beam.direction, b.start, way);
        float relative = at.squared / (push.radius * push.radius);
        if (at.sine > 0.0 && relative < 1.0 && at.along >= 0.0 && at.along < reach && at.t > beam.from && at.t < beam.to) {
            vec3 passed = passed_to(at.t) * transmittance(beam.m.sigma_t, at.along);
            float weight = line_profile(PROFILE, relative) / (push.radius * at.sine);
            weight *= phase_function(beam.m.phase, beam.m.phase_parameter, way, -beam.direction);
            if (POINTS) {
                weight *= 1.0 - share_of_points(unpack_flight(q2) + at.along, at.sine);
            }
            ++gathered_events;
            gathered += weight * beam.m.sigma_s * passed * b.flux;
        }
    }
}

// Lets a plane's light count where the ray meets it, and its ray stand for all of them with the probability of its share.
void add_plane(uint record, PhotonPlane p) {
    if (!counts_here(p.medium, p.bounce)) {
        return;
    }
    PlaneMeeting at = meet_plane(beam.origin, beam.direction, p.start, p.first, p.second);
    bool inside = all(greaterThanEqual(at.along, vec2(0.0))) && all(lessThan(at.along, vec2(1.0)));
    if (!(at.jacobian > 0.0) || !inside || !(at.t > beam.from && at.t < beam.to)) {
        return;
    }
    vec2 lengths = vec2(length(p.first), length(p.second));
    vec3 way = p.second / lengths.y;
    // Bands that scatter nothing have no light here, however far they come.
    float extinction = plane_extinction(beam.m.sigma_s, beam.m.sigma_t);
    vec3 left = relative_transmittance(max(beam.m.sigma_t, vec3(extinction)), extinction, dot(at.along, lengths));
    float weight = lengths.x * lengths.y / at.jacobian * phase_function(beam.m.phase, beam.m.phase_parameter, way, -beam.direction);
    vec3 light = weight * beam.m.sigma_s * beam.m.sigma_s * passed_to(at.t) * left * p.flux;
    float all_bands = light.x + light.y + light.z;
    if (!(all_bands > 0.0 && all_bands < FAR_AWAY)) {
        return;
    }
    ++gathered_events;
    float variate = -log(1.0 - unit_float(pcg4d(beam.choice + uvec4(record, 0u, 0u, 0u)).w)) / all_bands;
    chosen.total += all_bands;
    if (chosen.resume == PLANE_RAY_ENDED || variate < chosen.variate) {
        chosen.origin = beam.origin + at.t * beam.direction;
        chosen.reach = at.along.y * lengths.y;
        chosen.direction = -way;
        chosen.resume = PLANE_RAY_BEGINS;
        chosen.color = beam.weight * light / all_bands;
        chosen.variate = variate;
    }
}

bool compact_visit_beam(uint record) {
    uvec4 q0 = event_quarter(record, 0u);
    uvec4 q1 = event_quarter(record, 1u);
    uvec4 q2 = uvec4(0u);
    if (WIDE) {
        q2 = event_quarter(record, 2u);
    }
    if (PLANES && is_plane(q2)) {
        add_plane(record, unpack_plane(q0, q1, q2));
        return !event_ends_leaf(q0);
    }
    if (BEAMS && !(POINTS && is_point(q2))) {
        add_beam(q0, q1, q2);
        return !event_ends_leaf(q0);
    }
    float radius = uintBitsToFloat(q1.y);
    vec2 approach = closest_approach(beam.origin, beam.direction, uintBitsToFloat(q0.xyz));
    bool counts = approach.y < radius * radius && counts_here(q0.w & EVENT_MEDIUM_MASK, q1.z >> PHOTON_BOUNCE_SHIFT);
    if (!MARCHES) {
        counts = counts && approach.x > beam.from && approach.x < beam.to;
    }
    if (counts) {
        vec3 weight = MARCHES ? marched(approach.x, approach.y, radius)
            : kernel_profile(PROFILE, approach.y / (radius * radius)) / (radius * radius) * passed_to(approach.x);
        if (weight != vec3(0.0)) {
            PhotonEvent e = unpack_event(q0, q1);
            // In grids there are no beams.
            if (POINTS && !(HAS_GRIDS && beam.m.has_grid != 0u)) {
                weight *= share_of_points(unpack_flight(q2), length(cross(e.direction, beam.direction)));
            }
            ++gathered_events;
            gathered += weight * phase_function(beam.m.phase, beam.m.phase_parameter, e.direction, -beam.direction) * e.flux;
        }
    }
    return !event_ends_leaf(q0);
}

// Finds how far light of each band comes through the grid, from `from` on; false where the quota has stopped it, at `from`.
bool walk_through_grid(uvec4 key, float end, inout float from) {
    GridWalk walk = begin_grid_walk(beam.m, beam.origin, beam.direction, from, end);
    uint iterations = GRID_WALK_QUOTA;
    uint outcome = GRID_COLLIDED;
    while (outcome == GRID_COLLIDED && any(equal(beam.reach, vec3(FAR_AWAY)))) {
        uvec4 bits = grid_draw(key, walk.draw++);
        float majorant;
        outcome = next_tentative_collision(beam.m, 1.0, -log(1.0 - unit_float(bits.x)), walk, iterations, majorant);
        if (outcome == GRID_COLLIDED) {
            ++walk.nulls;
            vec3 real = min(beam.m.sigma_t * (grid_density(beam.m, walk) / majorant), vec3(1.0));
            bvec3 collides = lessThan(vec3(unit_float(bits.y)), real);
            beam.reach = mix(beam.reach, min(beam.reach, vec3(walk.entry + walk.t)), collides);
        }
    }
    COUNT_MEDIUM(density_lookups, walk.nulls)
    from = resumed_start(from, walk.entry + walk.t);
    return outcome != GRID_STOPPED || from >= end;
}

// Prepares the query of a place, and notes what comes of light from the surface; false where nothing is asked for on the way. Nor is anything where a quota stops the walk
// through a grid (`walks`), which goes on another time (`goes_on`).
bool begin_beam(uint slot, uint place, WalkState path, bool goes_on, out bool walks) {
    walks = false;
    uint way_state = asking_state(path);
    if ((push.states >> way_state & 1u) == 0u) {
        return false;
    }
    MediumState state = MediumState(vec3(0.0), 0.0);
    if (status.rounds > 0u) {
        state = walk_medium_states[slot];
    }
    Hit hit = load_hit(place);
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, path.direction, walk_gathered[slot].interior);
    }
    beam.origin = path.origin;
    beam.direction = path.direction;
    beam.start = state.start;
    beam.to = hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, state.start);
    beam.from = max(state.start, 0.0);
    beam.bounce = asking_bounce(path);
    beam.classes = HAS_CLASSES ? push.classes[min(asking_state(path), ASKING_STATES - 1u)] >> CLASSES_IN_MEDIA_SHIFT : 0u;
    beam.medium = medium_inside(crossing.interior, push.surrounding);
    beam.reach = vec3(FAR_AWAY);
    bool asks = (push.volume_states >> way_state & 1u) != 0u && beam.medium != NO_MEDIUM;
    if (beam.medium != NO_MEDIUM) {
        beam.m = load_medium(beam.medium);
        asks = asks && beam.m.sigma_s != vec3(0.0);
    }
    bool asked_before = false;
    if (HAS_GRIDS) {
        // Of a ray that has just begun nothing has been asked for; of a way that path_medium.comp goes on with, its surface, too.
        float asked = state.start > 0.0 ? beam_asked[slot] : 0.0;
        asked_before = asked >= beam.to;
        beam.from = max(beam.from, asked);
        if (!asked_before && beam.medium != NO_MEDIUM && beam.m.has_grid != 0u) {
            float walked = beam.start;
            uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), BEAM_KEY + walk_round(slot), push.key.seed);
            if (goes_on) {
                walked = beam_ways[place].end;
                beam.reach = beam_ways[place].reach;
                key.w ^= floatBitsToUint(walked);
            }
            walks = !walk_through_grid(key, beam.to, walked);
            if (walks) {
                beam_ways[place] = BeamWay(vec3(0.0), beam.from, beam.reach, walked);
                return false;
            }
        }
        beam_asked[slot] = max(asked, beam.to);
    }
    vec3 surface = vec3(0.0);
    if (hit.triangle != NO_HIT && !asked_before) {
        surface = beam.medium != NO_MEDIUM ? passed_to(beam.to) : vec3(1.0);
        if (HAS_ABSORPTION && crossing.interior != OUTSIDE) {
            surface *= exp(-load_material(crossing.interior).absorption * (beam.to - beam.from));
        }
    }
    beam_ways[place] = BeamWay(surface, beam.from, beam.reach, beam.to);
    return asks && beam.from < beam.to;
}

// Prepares the query of a place again whose way is known.
void resume_beam(uint slot, uint place, WalkState path) {
    BeamWay way = beam_ways[place];
    Hit hit = load_hit(place);
    Crossing crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, path.direction, walk_gathered[slot].interior);
    }
    beam.origin = path.origin;
    beam.direction = path.direction;
    beam.start = status.rounds > 0u ? walk_medium_states[slot].start : 0.0;
    beam.from = way.start;
    beam.to = way.end;
    beam.reach = way.reach;
    beam.bounce = asking_bounce(path);
    beam.classes = HAS_CLASSES ? push.classes[min(asking_state(path), ASKING_STATES - 1u)] >> CLASSES_IN_MEDIA_SHIFT : 0u;
    beam.medium = medium_inside(crossing.interior, push.surrounding);
    beam.m = load_medium(beam.medium);
}

void main() {
    uint place = gl_GlobalInvocationID.x + (LINEAR ? push.first_place : 0u);
    if (!wave_has_arrived() || place >= status.active_count || (LINEAR && !beam_has_stopped(walk_resume[place]))) {
        return;
    }
    uint resume = BEAM_DONE;
    if (!LINEAR) {
        resume = walk_resume[place];
        if (beam_was_asked(resume)) {
            return;
        }
        if (!has_work_left()) {
            leave_for_later(STALLED_ARRIVAL);
            return;
        }
        walk_resume[place] = BEAM_DONE;
    }
    uint slot = load_slot(place);
    WalkState path = load_walk(slot);
    if (LINEAR) {
        resume_beam(slot, place, path);
    } else {
        bool walks;
        bool asks = begin_beam(slot, place, path, resume == BEAM_WALKING, walks);
        if (walks) {
            walk_resume[place] = BEAM_WALKING;
            count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
            leave_for_later(STALLED_ARRIVAL);
        }
        if (!asks) {
            return;
        }
    }
    if (MARCHES) {
        uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), BEAM_KEY + walk_round(slot), push.key.seed);
        beam.offset = unit_float(pcg4d(key).w);
    }
    if (PLANES) {
        beam.choice = pcg4d(uvec4(walk_sequence(slot), walk_index(slot), PLANE_CHOICE_KEY + walk_round(slot), push.key.seed));
        beam.weight = path.throughput * (push.scale * push.plane_weight);
        chosen.resume = PLANE_RAY_ENDED;
        chosen.total = 0.0;
        if (LINEAR && push.first > 0u) {
            chosen = plane_rays[place];
        }
    }
    gathered = vec3(0.0);
    gathered_events = 0u;
    bool complete = true;
    if (LINEAR) {
        for (uint record = push.first; record < push.last; ++record) {
            compact_visit_beam(record);
        }
    } else {
        // A march's places reach as far beyond the way's ends as kernels do, and count within alone.
        float far = min(beam.to, largest_component(beam.reach));
        complete = compact_beam_query(event_root, Ray(beam.origin, beam.from, beam.direction, far));
        count_work(QUERY_STEP_WORK * compact_steps + GRID_ITERATION_WORK * grid_iterations, QUERY_STEP_WORK * WORK_UNIT);
    }
    if (!complete) {
        walk_resume[place] = BEAM_STOPPED;
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
        return;
    }
    if (!LINEAR || push.first == 0u) {
        atomicAdd(beam_counters.queries, 1u);
    }
    COUNT_WIDE(beam_counters.events, gathered_events)
    // Of a query that goes through records also that there is none, for the records to come.
    if (PLANES && (LINEAR || chosen.total > 0.0)) {
        plane_rays[place] = chosen;
        if (!LINEAR) {
            walk_resume[place] = BEAM_TRACING;
        }
    }
    walk_gathered[slot].radiance += path.throughput * gathered * push.scale;
}
