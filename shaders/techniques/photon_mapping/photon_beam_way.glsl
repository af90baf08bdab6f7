// The ways of eye paths through media whose photons they ask for: where a way begins and ends, in which medium, and what the medium leaves of light along it and from the
// surface behind it. Shared by the queries of the volume map (photon_beam.glsl) and by the stage before those that have a queue (photon_beam_ways.comp).
//
// Transmittances are exact in homogeneous media. In a grid one walk a ray, of those that ask or meet a surface, by ratio tracking, leaves the product of its steps so far at each of these: unbiased for light from
// every place (photon_transmittance.glsl). One that its quota stops goes on in a later dispatch, before anything is asked. Or a table has the ray's optical lengths at places as far apart
// (TABULATES), by the density midway between them, in between by lines: without noise, but wrong where the density is not straight within that. A way that path_medium.comp goes through in
// several rounds is asked for once: `beam_asked` says how far.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_BEAM_WAY_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_BEAM_WAY_GLSL

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_eye.glsl"
#include "techniques/photon_mapping/photon_plane_ray.glsl"
#include "techniques/photon_mapping/photon_transmittance.glsl"

layout(constant_id = 60) const bool TABULATES = false;  // the transmittance along rays through grids, instead of walks

// Bounces of a path whose queries are counted by themselves, the last one with all that come after it.
const uint BEAM_BOUNCES = 4u;

// Beside the media, so that set 1 is free for the ray index (photon_beam_fused.comp).
// descriptor set 3 from binding 8: PhotonBeamSet

layout(set = 3, binding = 8) uniform utextureBuffer event_pairs;
layout(set = 3, binding = 9) uniform utextureBuffer event_records;
layout(set = 3, binding = 11, scalar) restrict buffer BeamCounters {
    uint queries;
    uint events[2];   // kernels that a ray pierced: 64 bits, the low word first
    // Where COUNT_FETCHES says so, also:
    uint queries_by_bounce[BEAM_BOUNCES];  // of the first ray of a path, the second one, and so on
    uint nodes[2];    // of the tree, fetched once for all rays that go through it together
    uint records[2];  // likewise
    uint tests[2];    // pairs of nodes, and records, that each ray has gone through
} beam_counters;
layout(set = 3, binding = 12, scalar) restrict buffer PhotonBeamWays { BeamWay beam_ways[]; };    // by place
layout(set = 3, binding = 13, scalar) restrict buffer PhotonBeamAsked { float beam_asked[]; };    // by slot; of scenes with grids
// Of maps with planes; elsewhere some other buffer is bound, and nothing is read or written. Rays of earlier bounces have ended.
layout(set = 3, binding = 14, scalar) restrict buffer PhotonPlaneRays { PlaneRay plane_rays[]; };
// The queue of the places that ask (photon_queue.glsl); where there is none some other buffer is bound, and nothing is read.
layout(set = 3, binding = 15, scalar) restrict readonly buffer BeamQueueHead {
    uint groups[3];
    uint count;
    uint block_size;
} gather_head;
layout(set = 3, binding = 16, scalar) restrict readonly buffer BeamPlaces { uint gather_places[]; };
layout(set = 3, binding = 17, scalar) restrict readonly buffer BeamBlocks { uint gather_blocks[]; };
// WAY_STEPS by place, of scenes with grids; elsewhere there is no more than one, and nothing is read or written. What is left of light behind a step and its distance along the ray, or four
// places of a table: integrals of the density from where it begins, m.
layout(set = 3, binding = 18, scalar) restrict buffer PhotonWaySteps { vec4 way_steps[]; };

#include "techniques/photon_mapping/photon_queued_place.glsl"

uvec4 compact_quarter(uint index) { return texelFetch(event_pairs, int(index)); }

#include "accel/compact_bvh.glsl"

layout(set = 3, binding = 10, scalar) restrict readonly buffer PhotonEventRoot { CompactRoot event_root; };

layout(push_constant, scalar) uniform Push {
    WalkKey key;
    uint surrounding;    // index of the medium outside all bodies, or NO_MEDIUM
    uint states;         // of a path that asks, in media or on surfaces, a bit each
    uint volume_states;  // of one that asks on its way through media
    uint least_bounces;  // scatterings in all, with that of the event
    uint most_bounces;
    float scale;         // of stored fluxes
    float beam_radius;
    float collision_radius;  // beside beams
    float plane_weight;  // of planes' fluxes, beside the scale
    float photons;       // of a pass, of CARRIES_LIGHT_DISTANCE
    uint first_place;    // of LINEAR
    uint first;          // of the records that a linear query goes through
    uint last;
    uint classes[ASKING_STATES];  // by state of a path: the classes of photons that count on surfaces, and 16 bits higher those that do in media
} push;

#include "walk/draws.glsl"
#include "transport/bodies.glsl"
#include "transport/media_tracking.glsl"
#include "walk/media.glsl"

// Stands for the round in the key of the random numbers, so that those of ways and shadow rays do not return.
const uint BEAM_KEY = 0x20000000u;

// What the query under way is about.
struct Beam {
    vec3 origin;
    vec3 direction;
    float from;     // of the part that is asked for
    float to;
    float start;    // from where the medium takes from light
    float reach;    // as BeamWay has the rest of what grids need
    uint steps;
    uint first_step;
    float entry;
    float spacing;
    uint medium;
    SceneMedium m;
    uint classes;   // of photons that count, a bit each, where there are classes
    uint bounce;    // scatterings between the event and the eye
    float offset;   // of the places of a march, in their distance
    uvec4 choice;   // key of the choice among planes
    vec3 weight;    // of the light of planes, on its way to the picture
};
Beam beam;

// `before` and `count` more if all of these steps are before t, of which the last one tells.
uint steps_before(float t, uint before, uint count) {
    uint last = before + count - 1u;
    return last < beam.steps && way_steps[beam.first_step + last].w < t ? before + count : before;
}

// What the walk has left of light at a distance. WAY_STEPS is sixteen: each comparison halves the steps that may be the last one before, and loops would count towards what a driver runs.
vec3 walked_to(float t) {
    uint before = steps_before(t, 0u, 8u);
    before = steps_before(t, before, 4u);
    before = steps_before(t, before, 2u);
    before = steps_before(t, before, 1u);
    before = steps_before(t, before, 1u);
    return before > 0u ? way_steps[beam.first_step + before - 1u].xyz : vec3(1.0);
}

float table_entry(uint place) { return way_steps[beam.first_step + place / 4u][place % 4u]; }

vec3 tabulated_to(float t) {
    if (!(beam.spacing > 0.0)) {
        return vec3(1.0);
    }
    float at = clamp((t - beam.entry) / beam.spacing, 0.0, float(WAY_PLACES));
    uint place = min(uint(at), WAY_PLACES - 1u);
    float before = place > 0u ? table_entry(place - 1u) : 0.0;
    return transmittance(beam.m.sigma_t, mix(before, table_entry(place), at - float(place)));
}

// What the medium leaves of light at a distance.
vec3 passed_to(float t) {
    if (HAS_GRIDS && beam.m.has_grid != 0u) {
        return TABULATES ? tabulated_to(t) : walked_to(t);
    }
    return transmittance(beam.m.sigma_t, t - beam.start);
}

// The integral of the density along a ray as far as `end`, m; for rays that ask (`stores`) the table of it, too.
float tabulate(float end, bool stores) {
    GridWalk walk = begin_grid_walk(beam.m, beam.origin, beam.direction, beam.start, end);
    beam.entry = walk.entry;
    beam.spacing = max(walk.t_end, 0.0) / float(WAY_PLACES);
    if (beam.spacing == 0.0) {
        return 0.0;
    }
    float so_far = 0.0;
    for (uint i = 0u; i < WAY_STEPS; ++i) {
        vec4 lengths;
        for (uint j = 0u; j < 4u; ++j) {
            walk.t = (float(4u * i + j) + 0.5) * beam.spacing;
            so_far += beam.spacing * grid_density(beam.m, walk);
            lengths[j] = so_far;
        }
        if (stores) {
            way_steps[beam.first_step + i] = lengths;
        }
    }
    grid_iterations += WAY_PLACES;
    COUNT_MEDIUM(density_lookups, WAY_PLACES)
    return so_far;
}

// Walks through the grid from `from` on, with what has `passed` so far, whose steps are kept for rays that ask (`stores`); false where the quota has stopped it, at `from`.
bool walk_through_grid(uvec4 key, float end, bool stores, inout vec3 passed, inout float from) {
    GridWalk walk = begin_grid_walk(beam.m, beam.origin, beam.direction, from, end);
    uint iterations = GRID_WALK_QUOTA;
    uint outcome = GRID_COLLIDED;
    while (outcome == GRID_COLLIDED && passed != vec3(0.0)) {
        uvec4 bits = grid_draw(key, walk.draw++);
        float majorant;
        outcome = next_tentative_collision(beam.m, 1.0, -log(1.0 - unit_float(bits.x)), walk, iterations, majorant);
        if (outcome == GRID_COLLIDED) {
            ++walk.nulls;
            vec3 real = min(beam.m.sigma_t * (grid_density(beam.m, walk) / majorant), vec3(1.0));
            if (attenuate(real, beam.steps, vec2(unit_float(bits.y), unit_float(bits.z)), passed)) {
                if (stores) {
                    way_steps[beam.first_step + beam.steps] = vec4(passed, walk.entry + walk.t);
                }
                ++beam.steps;
            }
        }
    }
    COUNT_MEDIUM(density_lookups, walk.nulls)
    beam.reach = passed == vec3(0.0) ? walk.entry + walk.t : FAR_AWAY;
    from = resumed_start(from, walk.entry + walk.t);
    return outcome != GRID_STOPPED || from >= end;
}

// What a query has of the ray of a place, and what the ray crosses at the surface that it meets.
void begin_ray(uint slot, WalkState path, Hit hit, out Crossing crossing) {
    crossing = Crossing(OUTSIDE, OUTSIDE, false);
    if (hit.triangle != NO_HIT) {
        crossing = cross_surface(hit.triangle, path.direction, walk_gathered[slot].interior);
    }
    uint state = asking_state(path);
    beam.origin = path.origin;
    beam.direction = path.direction;
    beam.start = status.rounds > 0u ? walk_medium_states[slot].start : 0.0;
    beam.bounce = asking_bounce(path);
    beam.classes = HAS_CLASSES ? push.classes[min(state, ASKING_STATES - 1u)] >> CLASSES_IN_MEDIA_SHIFT : 0u;
    beam.medium = medium_inside(crossing.interior, push.surrounding);
}

// Prepares the query of a place whose ray has that hit, and notes what comes of light from the surface; false where nothing is asked for on the way. Nor is anything where a quota stops the walk
// through a grid (`walks`), which goes on another time (`goes_on`).
bool begin_beam(uint slot, uint place, WalkState path, Hit hit, bool goes_on, out bool walks) {
    walks = false;
    uint way_state = asking_state(path);
    if ((push.states >> way_state & 1u) == 0u) {
        return false;
    }
    Crossing crossing;
    begin_ray(slot, path, hit, crossing);
    beam.to = hit.triangle == NO_HIT ? FAR_AWAY : max(hit.t, beam.start);
    beam.from = max(beam.start, 0.0);
    beam.reach = FAR_AWAY;
    beam.steps = 0u;
    beam.first_step = WAY_STEPS * place;
    beam.entry = 0.0;
    beam.spacing = 0.0;
    bool asks = (push.volume_states >> way_state & 1u) != 0u && beam.medium != NO_MEDIUM;
    if (beam.medium != NO_MEDIUM) {
        beam.m = load_medium(beam.medium);
        asks = asks && beam.m.sigma_s != vec3(0.0);
    }
    // Queries of surfaces want what is left of light from there. What a grid leaves of other light, the environment's too, is in the weight of the path's way (path_medium.comp).
    bool has_surface = hit.triangle != NO_HIT && !crossing.boundary;
    bool in_grid = HAS_GRIDS && beam.medium != NO_MEDIUM && beam.m.has_grid != 0u;
    vec3 passed = vec3(1.0);
    bool asked_before = false;
    if (HAS_GRIDS) {
        // Of a ray that has just begun nothing has been asked for; of a way that path_medium.comp goes on with, its surface, too.
        float asked = beam.start > 0.0 ? beam_asked[slot] : 0.0;
        asked_before = asked >= beam.to;
        beam.from = max(beam.from, asked);
        if (!asked_before && in_grid && (asks || has_surface)) {
            if (TABULATES) {
                passed = transmittance(beam.m.sigma_t, tabulate(beam.to, asks));
            } else {
                float walked = beam.start;
                uvec4 key = uvec4(walk_sequence(slot), walk_index(slot), BEAM_KEY + walk_round(slot), push.key.seed);
                if (goes_on) {
                    BeamWay so_far = beam_ways[place];
                    walked = so_far.end;
                    passed = so_far.surface;
                    beam.steps = so_far.steps;
                    key.w ^= floatBitsToUint(walked);
                }
                walks = !walk_through_grid(key, beam.to, asks, passed, walked);
                if (walks) {
                    beam_ways[place] = BeamWay(passed, beam.from, walked, beam.reach, beam.steps, 0.0, 0.0);
                    return false;
                }
            }
        }
        beam_asked[slot] = max(asked, beam.to);
    }
    vec3 surface = vec3(0.0);
    if (has_surface && !asked_before) {
        surface = in_grid || beam.medium == NO_MEDIUM ? passed : passed_to(beam.to);
        if (HAS_ABSORPTION && crossing.interior != OUTSIDE) {
            surface *= exp(-load_material(crossing.interior).absorption * (beam.to - beam.from));
        }
    }
    beam_ways[place] = BeamWay(surface, beam.from, beam.to, beam.reach, beam.steps, beam.entry, beam.spacing);
    return asks && beam.from < beam.to;
}

// Prepares the query of a place again whose way is known.
void resume_beam(uint slot, uint place, WalkState path) {
    BeamWay way = beam_ways[place];
    Crossing crossing;
    begin_ray(slot, path, load_hit(place), crossing);
    beam.from = way.start;
    beam.to = way.end;
    beam.reach = way.reach;
    beam.steps = way.steps;
    beam.first_step = WAY_STEPS * place;
    beam.entry = way.entry;
    beam.spacing = way.spacing;
    beam.m = load_medium(beam.medium);
}

#endif
