// Radiance from the volume map along eye paths' ways through media: beams of photons, each counting where the ray passes it, and planes, where the ray meets them; or events, by the beam estimate, each event whose kernel the ray pierces counting at its closest point; or the
// marched estimate, kernels of space at places of the ray that lie as far apart as they are wide, the first one by chance. Also what the medium leaves of light from the
// surface that the path has met, for the surface's query behind it.
//
// L = sum_j K(d_j / h_j) / h_j^2 tau(t_j) p(w_j, -v) Phi_j, with Phi_j the flux that the event scatters: the corrected units of the source, where the albedo stands
// instead of the scattering coefficient. Of beams L = sum_j K(d_j / h) / h tau(t_j) sigma_s p(w_j, -v) tau_j Phi_j / sin(w_j, v), with tau_j along the beam; of short ones, which end by chance as
// flights in the band that comes farthest do, it is what other bands have less of.
// Of planes L = sum_j tau(t_j) sigma_s^2 p(w_j', -v) tau_j' Phi_j / |v . (w_j x w_j')| with the directions w_j and w_j' of both flights, and tau_j' what is left there of other
// bands than the one that flights end as in: without blur. One of those that a ray meets has a ray that tells whether it is seen (photon_plane_ray.glsl).
// Where collisions are stored beside beams each has the share of the balance heuristic (point_share). Where eye paths go on, all have but the share that these leave (share_left_by_eye_paths,
// share_left_to_plane).
// Distances are measured from the eye, and the phase function is handed the way to the eye, -v. Events count in their own medium alone.
//
// With a queue (QUEUE) photon_beam_ways.comp has been to all places, and an invocation takes one of those that ask; without one an invocation per place first finds its way
// (photon_beam_way.glsl); photon_beam_fused.comp first finds the ray's hit, too, and has a main function of its own (BEAM_FINDS_HITS). With COMPACT_PACKET defined the rays of a subgroup go through the map together, wherever any of them goes. A ray's sum has the order of the map's
// leaves in each of these forms, and so the same bits; or the order of its records: a query that its quota stops leaves nothing and goes through all of them
// instead (LINEAR). Rays together meet it sooner, by the steps of all: where also the submission's work is
// used up, who is with a ray decides whether it stops, and last bits with it.
//
// PM-VOL-5, PM-VOL-7, PM-ST-2 to PM-ST-6: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 3.4.2.4, 7.1 and 7.4; W. Jarosz, M. Zwicker and H. W. Jensen, "The Beam Radiance Estimate
// for Volumetric Photon Mapping", 2008; W. Jarosz, D. Nowrouzezahrai, I. Sadeghi and H. W. Jensen, "A Comprehensive Theory of Volumetric Radiance Estimation Using Photon
// Points and Beams", 2011; J. Křivánek et al., "Unifying Points, Beams, and Paths in Volumetric Light Transport Simulation", 2014; B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light Transport", 2017. Deterministic in (seed, pixel, sample) and the map.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_BEAM_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_BEAM_GLSL

#include "walk/count_fetches.glsl"

bool compact_visit_beam(uint record);

#define COMPACT_BEAM
#ifdef COMPACT_PACKET
#define COMPACT_LEADS (!COUNT_FETCHES || subgroupElect())
#endif

#include "techniques/photon_mapping/photon_beam_way.glsl"
#include "techniques/photon_mapping/photon_event.glsl"
#include "accel/sphere.glsl"
#include "transport/phase.glsl"

layout(constant_id = 42) const uint PROFILE = KERNEL_EPANECHNIKOV;
layout(constant_id = 43) const bool LINEAR = false;  // goes through records, for places that have stopped
layout(constant_id = 46) const uint QUEUE = QUEUE_SLOTS;
layout(constant_id = 47) const bool MARCHES = false;
layout(constant_id = 55) const bool BEAMS = false;   // the map holds ways of photons
layout(constant_id = 56) const bool PLANES = false;  // and planes
layout(constant_id = 57) const bool POINTS = false;  // and collisions
const bool WIDE = PLANES || POINTS;
layout(constant_id = 61) const bool SHORT_WAYS = false;  // ways end by chance
layout(constant_id = 62) const bool AFTER_FUSED = false; // goes on where photon_beam_fused.comp has stopped, with ways that may be known

// Tells the words of the choice among planes from others.
const uint PLANE_CHOICE_KEY = 0x10000000u;
// Places of a march within a kernel, at most: it is twice as wide as they lie apart.
const uint MARCH_PLACES = 3u;

vec3 gathered;
uint gathered_events;
PlaneRay chosen;  // among the planes so far

uvec4 event_quarter(uint record, uint quarter) {
    return texelFetch(event_records, int((WIDE ? WIDE_QUARTERS : EVENT_QUARTERS) * record + quarter));
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

// Whether photons of this medium count for the ray, with so many scatterings before the last one, or of this class.
bool counts_here(uint medium, uint history) {
    uint bounces = history + 1u + beam.bounce;
    bool counts = compact_mine && medium == beam.medium;
    if (HAS_CLASSES) {
        counts = counts && (beam.classes >> history & 1u) != 0u;
    }
    if (COUNTS_BOUNCES) {
        counts = counts && bounces >= push.least_bounces && bounces <= push.most_bounces;
    }
    return counts;
}

// A short beam reaches a place with the same probability as the photon's own flight, so both densities have the same transmittance and it cancels: the flight counts as 0.
float share_of_points(float flight, float sine) {
    return point_share(mean_extinction(beam.m.sigma_t), SHORT_WAYS ? 0.0 : flight, push.collision_radius, push.beam_radius, sine);
}

// What takes from light along a beam.
vec3 way_extinction() { return SHORT_WAYS ? short_way_extinction(beam.m.sigma_s, beam.m.sigma_t) : beam.m.sigma_t; }

// Share of a record's light that eye paths which go on leave to photons, by the density of its phase function.
float share_left_by_eye_paths(uvec4 q2, float phase, float sine, bool has_beams) {
    float extinction = mean_extinction(beam.m.sigma_t);
    if (PLANES) {
        float across = across_of_beams(sine, extinction, push.beam_radius);
        return photon_share(beside_planes_light2(q2), even_distance2_across(across, phase, push.photons));
    }
    float even2 = even_distance2(phase, sine, extinction, push.collision_radius, push.beam_radius, push.photons, has_beams);
    return photon_share(unpack_light_distance2(q2), even2);
}

// Adds a beam's light where the ray passes it.
void add_beam(uvec4 q0, uvec4 q1, uvec4 q2) {
    PhotonBeam b = unpack_beam(q0, q1);
    vec3 way = b.end - b.start;
    float reach = length(way);
    if (reach > 0.0 && counts_here(b.medium, b.bounce)) {
        way /= reach;
        BeamMeeting at = meet_beam(beam.origin, beam.direction, b.start, way);
        float relative = at.squared / (push.beam_radius * push.beam_radius);
        if (at.sine > 0.0 && relative < 1.0 && at.along >= 0.0 && at.along < reach && at.t > beam.from && at.t < beam.to) {
            vec3 passed = passed_to(at.t) * transmittance(way_extinction(), at.along);
            float weight = line_profile(PROFILE, relative) / (push.beam_radius * at.sine);
            float phase = phase_function(beam.m.phase, beam.m.phase_parameter, way, -beam.direction);
            weight *= phase;
            if (CARRIES_LIGHT_DISTANCE) {
                weight *= share_left_by_eye_paths(q2, phase, at.sine, true);
            }
            if (POINTS) {
                weight *= 1.0 - share_of_points(unpack_flight(q2) + at.along, at.sine);
            }
            ++gathered_events;
            gathered += weight * beam.m.sigma_s * passed * b.flux;
        }
    }
}

// The same of a plane's light, of flights of these lengths and directions where the ray meets them, by the density of the second scattering. Only a share of ways has planes.
float share_left_to_plane(PhotonPlane p, PlaneMeeting at, vec2 lengths, vec3 way, float phase) {
    float across = across_of_planes(at.jacobian / (lengths.x * lengths.y), mean_extinction(beam.m.sigma_t));
    float first = p.light < 0.0 ? phase_function(beam.m.phase, beam.m.phase_parameter, p.first / lengths.x, way) : 1.0;
    float light2 = distance2_in_plane(p.light, at.along.x * lengths.x, first);
    return photon_share(light2, even_distance2_across(across, phase, push.photons / push.plane_weight));
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
    float phase = phase_function(beam.m.phase, beam.m.phase_parameter, way, -beam.direction);
    float weight = lengths.x * lengths.y / at.jacobian * phase;
    if (CARRIES_LIGHT_DISTANCE) {
        weight *= share_left_to_plane(p, at, lengths, way, phase);
    }
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
            float phase = phase_function(beam.m.phase, beam.m.phase_parameter, e.direction, -beam.direction);
            float sine = POINTS ? length(cross(e.direction, beam.direction)) : 0.0;
            // In grids there are no beams.
            if (POINTS && !(HAS_GRIDS && beam.m.has_grid != 0u)) {
                weight *= share_of_points(unpack_flight(q2), sine);
            }
            if (CARRIES_LIGHT_DISTANCE) {
                weight *= share_left_by_eye_paths(q2, phase, sine, !(HAS_GRIDS && beam.m.has_grid != 0u));
            }
            ++gathered_events;
            gathered += weight * phase * e.flux;
        }
    }
    return !event_ends_leaf(q0);
}

// Prepares the query of a place that may be asked for at all; false where it is not, or not yet.
bool prepare_beam(uint slot, uint place, WalkState path, uint resume) {
    if (LINEAR || QUEUE != QUEUE_SLOTS || (AFTER_FUSED && resume == BEAM_ASKS)) {
        resume_beam(slot, place, path);
        return true;
    }
    bool walks;
    bool asks = begin_beam(slot, place, path, load_hit(place), resume == BEAM_WALKING, walks);
    if (!asks) {
        count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
    }
    if (walks) {
        walk_resume[place] = BEAM_WALKING;
        leave_for_later(STALLED_ARRIVAL);
    }
    return asks;
}

// Gathers along the way that is prepared; false when a quota stops it.
bool gather_events() {
    gathered = vec3(0.0);
    gathered_events = 0u;
    if (LINEAR) {
        for (uint record = push.first; record < push.last; ++record) {
            compact_visit_beam(record);
        }
        compact_records = push.last - push.first;
        compact_steps = compact_records;
        return true;
    }
    // A march's places reach as far beyond the way's ends as kernels do, and count within alone.
    float far = min(beam.to, beam.reach);
    bool complete = compact_beam_query(event_root, Ray(beam.origin, beam.from, beam.direction, far));
    count_work(QUERY_STEP_WORK * compact_steps + GRID_ITERATION_WORK * grid_iterations, QUERY_STEP_WORK * WORK_UNIT);
    return complete;
}

// Asks for the light of a place whose query is prepared; false when a quota stops it, and nothing is added.
bool ask_beam(uint slot, uint place, WalkState path) {
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
    bool complete = gather_events();
    if (COUNT_FETCHES) {
        COUNT_WIDE(beam_counters.nodes, compact_counters.x)
        COUNT_WIDE(beam_counters.records, compact_records)
        COUNT_WIDE(beam_counters.tests, compact_steps)
    }
    if (!complete) {
        return false;
    }
    if (!LINEAR || push.first == 0u) {
        atomicAdd(beam_counters.queries, 1u);
        if (COUNT_FETCHES) {
            atomicAdd(beam_counters.queries_by_bounce[min(status.rounds, BEAM_BOUNCES - 1u)], 1u);
        }
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
    return true;
}

#ifndef BEAM_FINDS_HITS
void main() {
    uint place = gl_GlobalInvocationID.x + (LINEAR ? push.first_place : 0u);
    if (QUEUE != QUEUE_SLOTS) {
        place = queued_place(QUEUE, place);
    }
    if (!wave_has_arrived() || place >= status.active_count || (LINEAR && !beam_has_stopped(walk_resume[place]))) {
        return;
    }
    uint resume = BEAM_DONE;
    if (!LINEAR) {
        resume = walk_resume[place];
        if (QUEUE == QUEUE_SLOTS ? beam_was_asked(resume) : resume != BEAM_ASKS) {
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
    if (prepare_beam(slot, place, path, resume) && !ask_beam(slot, place, path)) {
        walk_resume[place] = BEAM_STOPPED;
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
#endif

#endif
