#version 460
// Joins eye subpaths to vertices of light subpaths: where an eye path has arrived, some of all vertices of the pass, each drawn evenly, with the scattering at both
// ends, the geometry term between them, the weight of the path against all other ways to make it, and a shadow ray.
//
// An invocation is for a place. One whose ray a quota stops notes where it is, marks itself and stalls the wave; further dispatches go on there. Places that are left
// for later, since the submission's work is used up, stall the wave before they begin.
//
// T. Davidovič, J. Křivánek, M. Hašan, P. Slusallek, "Progressive Light Transport Simulation on the GPU", 2014: a cache of light vertices. Deterministic in (seed, pixel, sample).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint least_bounces;
    vec3 scene_upper;
    uint most_bounces;
    WalkKey key;        // sequences are pixels, places in them samples
    vec3 camera_forward;
    float camera_measure;
    uint vertices;      // of the pass
    float scale;        // vertices over connections and walks of the pass
    uint first_place;
    uint goes_on;       // 1 for places that have stopped
} push;

#include "techniques/bidirectional/bdpt_joint.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

bool begin_receiver(uint slot, uint place, out Receiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    r.state = take_path_state(path);
    r.medium = NO_MEDIUM;
    r.bounce = path.bounce;
    // Either vertex scatters once more.
    if (hit.triangle == NO_HIT || r.bounce + 2u > push.most_bounces) {
        return false;
    }
    r.arrival = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(r.arrival) || !arrival_has_rough_lobes(r.arrival)) {
        return false;
    }
    r.interior = arrival_interior(r.arrival, HAS_TRANSMISSION ? walk_gathered[slot].interior : OUTSIDE);
    r.throughput = absorbed(path.throughput, r.interior, hit.t);
    r.weights = eye_weights(slot, path, r.arrival, hit.t);
    return r.throughput != vec3(0.0);
}

// Goes on with the connections of a place.
void connect(Receiver r, uint slot, inout ConnectionState at, out uint rays) {
    rays = 0u;
    bool stopped = false;
    do {
        uvec4 words = connection_words(slot, r.bounce, at.next);
        ShadowWay shadow;
        vec3 found = connection(r, chosen_vertex(words, push.vertices), shadow);
        if (found != vec3(0.0)) {
            rays += at.cursor == INDEX_START ? 1u : 0u;
            if (HAS_ALPHA) {
                candidate_key = words;
            }
            Hit hit = no_hit(shadow.ray.t_max);
            at.cursor = any_hit(shadow.ray, at.cursor, hit);
            stopped = at.cursor != INDEX_FINISHED;
            at.sum += stopped || hit.triangle != NO_HIT ? vec3(0.0) : found;
        }
        at.cursor = stopped ? at.cursor : INDEX_START;
        at.next += stopped ? 0u : 1u;
    } while (!stopped && at.next < CONNECTIONS);
}

void main() {
    uint place = push.first_place + gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    bool goes_on = push.goes_on != 0u;
    uint resume = walk_resume[place];
    if (goes_on ? resume != CONNECT_STOPPED : resume == CONNECT_STOPPED || resume == CONNECT_DONE) {
        return;
    }
    if (!goes_on && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = CONNECT_DONE;
    uint slot = load_slot(place);
    Receiver r;
    if (!begin_receiver(slot, place, r)) {
        return;
    }
    ConnectionState at = ConnectionState(vec3(0.0), 0u, INDEX_START);
    if (goes_on) {
        at = connection_states[place];
    }
    uint first = at.next;
    uint rays;
    connect(r, slot, at, rays);
    COUNT_WIDE(bdpt_counters.connections, at.next - first)
    COUNT_WIDE(bdpt_counters.shadow_rays, rays)
    if (!goes_on) {
        count_work(index_iterations + CONNECT_ITERATIONS * CONNECTIONS, WORK_UNIT);
    }
    if (at.next == CONNECTIONS) {
        walk_gathered[slot].radiance += r.throughput * at.sum * push.scale;
        return;
    }
    connection_states[place] = at;
    walk_resume[place] = CONNECT_STOPPED;
    if (goes_on) {
        atomicAdd(bdpt_counters.remaining, 1u);
    } else {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
