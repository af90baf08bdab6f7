#version 460
// Joins eye subpaths to vertices of light subpaths, as bdpt_connect.comp does, in scenes with media: where an eye path has arrived at a surface, or where it collides on the way there, with
// vertices on surfaces and at collisions, with a shadow ray that passes boundaries and brings what the media let through.
//
// Collisions are those of bdpt_eye_medium.comp, by the same random numbers: a path is joined at its collision or at its surface, never at both, with the weight that flights have; one
// that stops in a grid is joined where it goes on. An invocation is for a place, and takes so many stretches of shadow rays a dispatch. One that has not come to its end notes where it
// is and how the path's flight has ended, marks itself and stalls the wave; further dispatches go on there.
//
// CL-BDPT-MEDIA: E. Lafortune and Y. Willems, "Rendering Participating Media with Bidirectional Path Tracing", 1996. Deterministic in (seed, pixel, sample).
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "transport/media_features.glsl"
#include "techniques/bidirectional/bdpt_media_set.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "walk/wave.glsl"

layout(constant_id = 54) const uint STRETCHES = 1u;  // of shadow rays of a place, in a dispatch

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
    uint surrounding;   // index of the medium outside all bodies, or NO_MEDIUM
} push;

#include "techniques/bidirectional/bdpt_joint.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"
#include "walk/flight.glsl"
#include "walk/medium_ray.glsl"

// Tells the walks of these rays through grids from those of the paths' own.
const uint JOINT_RATIO_SEED = 0x6a747261u;

// The flight of the path in a slot, which is in that state; whether it ends where something may be joined.
bool end_flight(uint slot, WalkState path, Hit hit, uint path_state, out FlightEnd end) {
    bool scatters = state_behind(path_state, LOBE_VOLUME) != PATH_SET_DEAD;
    Flight f = fly(slot, path, hit, push.surrounding, scatters, vec3(0.0), medium_state(slot));
    bool collides = f.outcome == GRID_COLLIDED;
    end = FlightEnd(f.weight, f.t, collides ? f.medium : NO_MEDIUM, f.crossing.interior);
    return collides || !(f.outcome == GRID_STOPPED || hit.triangle == NO_HIT || f.crossing.boundary);
}

// Prepares the receiver of a place, whose path's flight is known where it goes on; false where nothing is joined.
bool begin_receiver(uint slot, uint place, inout FlightEnd end, out Receiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
    r.state = take_path_state(path);
    r.bounce = path.bounce;
    // Either vertex scatters once more.
    if (r.bounce + 2u > push.most_bounces) {
        return false;
    }
    if (push.goes_on == 0u && !end_flight(slot, path, hit, r.state, end)) {
        return false;
    }
    r.medium = end.medium;
    r.interior = end.interior;
    r.throughput = path.throughput * end.weight;
    if (is_collision(r.medium)) {
        r.arrival = collision_at(path.origin + end.t * path.direction, path.direction);
        r.weights = eye_weights_under(slot, path, 1.0, end.t);
        return r.throughput != vec3(0.0);
    }
    r.arrival = arrival_at(hit, path.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(r.arrival) || !arrival_has_rough_lobes(r.arrival)) {
        return false;
    }
    r.interior = arrival_interior(r.arrival, end.interior);
    r.weights = eye_weights(slot, path, r.arrival, hit.t);
    return r.throughput != vec3(0.0);
}

// Goes on with the connections of a place.
void connect(Receiver r, uint slot, inout MediumConnectionState at, out uint rays) {
    rays = 0u;
    bool stopped = false;
    for (uint stretch = 0u; stretch < STRETCHES && at.next < CONNECTIONS && !stopped; ++stretch) {
        uvec4 words = connection_words(slot, r.bounce, at.next);
        ShadowWay shadow;
        vec3 found = connection(r, chosen_vertex(words, push.vertices), shadow);
        bool ended = found == vec3(0.0);
        if (!ended) {
            if (at.begun == 0u) {
                ++rays;
                at.begun = 1u;
                at.ray = begin_medium_ray(shadow);
            }
            if (HAS_ALPHA) {
                candidate_key = words;
            }
            stopped = !search_stretch(shadow.ray, at.ray);
            if (!stopped) {
                ended = pass_stretch(shadow.ray, push.surrounding, uvec4(words.yzw, words.x ^ JOINT_RATIO_SEED), at.ray);
                at.sum += ended ? found * at.ray.transmittance : vec3(0.0);
            }
        }
        if (ended) {
            at.begun = 0u;
            ++at.next;
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
    if (goes_on ? resume != CONNECT_STOPPED : resume == CONNECT_STOPPED || resume == CONNECT_DONE) {
        return;
    }
    if (!goes_on && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = CONNECT_DONE;
    uint slot = load_slot(place);
    MediumConnectionState at = MediumConnectionState(vec3(0.0), 0u, 0u, MediumRay(vec3(1.0), INDEX_START, no_hit(0.0), 0.0, OUTSIDE, 0u),
                                                     FlightEnd(vec3(1.0), 0.0, NO_MEDIUM, OUTSIDE));
    if (goes_on) {
        at = medium_connection_states[place];
    }
    Receiver r;
    if (!begin_receiver(slot, place, at.flight, r)) {
        count_work(GRID_ITERATION_WORK * grid_iterations, WORK_UNIT);
        return;
    }
    uint first = at.next;
    uint rays;
    connect(r, slot, at, rays);
    COUNT_WIDE(bdpt_counters.connections, at.next - first)
    COUNT_WIDE(bdpt_counters.shadow_rays, rays)
    if (!goes_on) {
        count_work(index_iterations + GRID_ITERATION_WORK * grid_iterations + CONNECT_ITERATIONS * CONNECTIONS, WORK_UNIT);
    }
    if (at.next == CONNECTIONS) {
        walk_gathered[slot].radiance += r.throughput * at.sum * push.scale;
        return;
    }
    medium_connection_states[place] = at;
    walk_resume[place] = CONNECT_STOPPED;
    if (goes_on) {
        atomicAdd(bdpt_counters.remaining, 1u);
    } else {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
