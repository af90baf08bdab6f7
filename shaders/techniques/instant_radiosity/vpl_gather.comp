#version 460
// Radiance from all virtual lights of a pass where eye paths have arrived, at surfaces that scatter into more than one direction: the scattering functions at
// both ends, the geometry term between them up to its bound, and a shadow ray.
//
// An invocation is for a place, and takes the lights in their order, so many a dispatch. A place that has not had all of them, or whose ray a quota stops,
// notes where it is, marks itself and stalls the wave; further dispatches go on there. Places that are left for later, since the submission's work is used up,
// stall the wave before they begin. Sums are kept between dispatches, so that they are the same bits however lights are shared out among them.
//
// SVO-G0, BG-8, BG-10, MET-V1: A. Keller, "Instant Radiosity", 1997; T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", 2006.
// Deterministic: a path's sum has the order of the lights.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "walk/wave.glsl"
#include "transport/path_set.glsl"
#include "wide_counter.glsl"

layout(constant_id = 44) const bool COUNTS_BOUNCES = false;  // the path set bounds the number of scatterings
layout(constant_id = 45) const uint LIGHTS_AT_ONCE = 1u;     // of a place, in a dispatch

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint states;         // of a path whose rough surfaces gather, a bit each
    vec3 scene_upper;
    uint least_bounces;  // scatterings in all
    uint most_bounces;
    uint lights;
    float scale;         // one over the walks of the pass
    float edge_bound;    // of EDGE_BOUND
    uint seed;           // of the pass
    uint first_place;
    uint goes_on;        // 1 for places that have stopped
} push;

#include "transport/random.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

// descriptor set 3: VirtualLightSet

layout(set = 3, binding = 0) uniform utextureBuffer virtual_light_texels;

#include "techniques/instant_radiosity/connection.glsl"

layout(set = 3, binding = 1, scalar) restrict buffer VirtualLightStates { GatherState gather_states[]; };  // by place
layout(set = 3, binding = 2, scalar) restrict buffer VirtualLightCounters {
    uint gathers;          // places that gathered
    uint remaining;        // places of a sweep that have not had all lights
    uint connections[2];   // 64 bits, low word first: pairs of a place and a light
    uint shadow_rays[2];   // those that might bring light
} gather_counters;
layout(set = 3, binding = 3, scalar) restrict readonly buffer LightDepartures { float departures[]; };  // path_departures, by slot

// Stand in walk_resume for a place that goes on in a later dispatch, and for one that has no light to gather or is done.
const uint GATHER_STOPPED = 0xFFFFFFFEu;
const uint GATHER_DONE = 0xFFFFFFFCu;
// Tells the candidates of these rays from those of the paths' own.
const uint GATHER_SEED = 0x76706c73u;

uint arriving_bounce(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce; }
uint arriving_state(WalkState path) { return HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u; }

// Prepares the receiver of a place; false where nothing is gathered.
bool begin_receiver(uint slot, uint place, out Receiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    r.bounce = arriving_bounce(path);
    // A light and the receiver scatter once more each.
    if ((push.states >> arriving_state(path) & 1u) == 0u || hit.triangle == NO_HIT || (COUNTS_BOUNCES && r.bounce + 2u > push.most_bounces)) {
        return false;
    }
    r.arrival = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(r.arrival) || !arrival_has_rough_lobes(r.arrival)) {
        return false;
    }
    r.interior = arrival_interior(r.arrival, HAS_TRANSMISSION ? walk_gathered[slot].interior : OUTSIDE);
    r.throughput = absorbed(path.throughput, r.interior, hit.t);
    if (EDGE_BOUND != EDGE_UNBOUNDED && path.pdf > 0.0) {
        // The path has come over an edge of whose light virtual lights bring what its bound leaves.
        float cos_there = EDGE_BOUND == EDGE_GEOMETRY ? departures[slot] : 1.0;
        float cos_here = abs(dot(path.direction, r.arrival.surface.geometric_normal));
        r.throughput *= 1.0 - bounded_share(EDGE_BOUND, push.edge_bound, cos_there, cos_here, hit.t * hit.t);
    }
    r.frame = scattering_frame(r.arrival, arrival_normal(r.arrival));
    return r.throughput != vec3(0.0);
}

// Whether the picture has what is scattered so often between a light source and the eye.
bool counts_bounces(uint bounces) { return !COUNTS_BOUNCES || (bounces >= push.least_bounces && bounces <= push.most_bounces); }

// Goes on with the lights of a place.
void gather(Receiver r, inout GatherState at, out uint rays) {
    rays = 0u;
    uint last = min(at.light + LIGHTS_AT_ONCE, push.lights);
    bool stopped = false;
    do {
        Ray ray;
        VirtualLight light = load_virtual_light(at.light);
        vec3 found = connection(r, light, ray);
        if (found != vec3(0.0) && counts_bounces(r.bounce + light.bounce + 2u)) {
            rays += at.cursor == INDEX_START ? 1u : 0u;
            if (HAS_ALPHA) {
                // The point and the way to it stand for the path, of which a stage between knows no number: under an orthographic camera ways are equal.
                uvec3 place = floatBitsToUint(r.arrival.surface.point.position);
                uvec3 way = floatBitsToUint(r.arrival.wo);
                candidate_key = pcg4d(uvec4(place, push.seed)) + pcg4d(uvec4(way.x ^ at.light, way.y, way.z + r.bounce, GATHER_SEED));
            }
            Hit hit = no_hit(ray.t_max);
            at.cursor = any_hit(ray, at.cursor, hit);
            stopped = at.cursor != INDEX_FINISHED;
            at.sum += stopped || hit.triangle != NO_HIT ? vec3(0.0) : found;
        }
        at.cursor = stopped ? at.cursor : INDEX_START;
        at.light += stopped ? 0u : 1u;
    } while (!stopped && at.light < last);
}

void main() {
    uint place = push.first_place + gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    bool goes_on = push.goes_on != 0u;
    uint resume = walk_resume[place];
    if (goes_on ? resume != GATHER_STOPPED : resume == GATHER_STOPPED || resume == GATHER_DONE) {
        return;
    }
    if (!goes_on && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = GATHER_DONE;
    uint slot = load_slot(place);
    Receiver r;
    if (!begin_receiver(slot, place, r)) {
        return;
    }
    GatherState at = GatherState(vec3(0.0), 0u, INDEX_START);
    if (goes_on) {
        at = gather_states[place];
    } else {
        atomicAdd(gather_counters.gathers, 1u);
    }
    uint first = at.light;
    uint rays;
    gather(r, at, rays);
    COUNT_WIDE(gather_counters.connections, at.light - first)
    COUNT_WIDE(gather_counters.shadow_rays, rays)
    if (!goes_on) {
        count_work(index_iterations + CONNECTION_ITERATIONS * LIGHTS_AT_ONCE, WORK_UNIT);
    }
    if (at.light == push.lights) {
        walk_gathered[slot].radiance += r.throughput * at.sum * push.scale;
        return;
    }
    gather_states[place] = at;
    walk_resume[place] = GATHER_STOPPED;
    if (goes_on) {
        atomicAdd(gather_counters.remaining, 1u);
    } else {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
