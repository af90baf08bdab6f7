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
#include "techniques/bidirectional/bdpt_set.glsl"
#include "walk/wave.glsl"

layout(constant_id = 52) const uint CONNECTIONS = 1u;  // of a place

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

#include "techniques/bidirectional/bdpt_eye.glsl"
#include "walk/draws.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

// Stand in walk_resume for a place that goes on in a later dispatch, and for one that has nothing to join or is done.
const uint CONNECT_STOPPED = 0xFFFFFFFEu;
const uint CONNECT_DONE = 0xFFFFFFFCu;
// Tells these draws from those of paths.
const uint CONNECT_SEED = 0x6a6f696eu;
// Loop iterations that a connection without its ray counts as.
const uint CONNECT_ITERATIONS = 8u;

// Scattering looked up at a connection, one after the other, so that its code is there once.
const uint LOOK_UPS = 4u;
const uint LOOK_UP_EYE = 0u;        // at the eye's vertex, on to the light's
const uint LOOK_UP_EYE_BACK = 1u;   // there, back
const uint LOOK_UP_LIGHT_BACK = 2u; // at the light's vertex, from the eye back along its subpath
const uint LOOK_UP_LIGHT = 3u;      // there, on to the eye

// Where the path of an invocation has arrived.
struct Receiver {
    Arrival arrival;
    PartialWeights weights;
    uint interior;    // body that the way there was in
    uint bounce;      // scatterings between the point and the eye
    vec3 throughput;  // from the point on
};

bool begin_receiver(uint slot, uint place, out Receiver r) {
    WalkState path = load_walk(slot);
    Hit hit = load_hit(place);
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

// Four random words of a connection: the first chooses the vertex.
uvec4 connection_words(uint slot, uint bounce, uint connection) {
    return pcg4d(uvec4(walk_sequence(slot), walk_index(slot), bounce * CONNECTIONS + connection, push.key.seed ^ CONNECT_SEED));
}

// Radiance that comes of joining both, if nothing stands between, and the ray that tells.
vec3 connection(Receiver r, LightVertex vertex, out Ray ray) {
    Surface s = r.arrival.surface;
    Arrival there = arrival_at(Hit(0.0, vertex.barycentrics, vertex.triangle), vertex.direction, push.scene_lower, push.scene_upper);
    vec3 way = there.surface.point.position - s.point.position;
    float squared = dot(way, way);
    ray = Ray(vec3(0.0), 0.0, vec3(0.0), 1.0);
    uint bounces = r.bounce + vertex.bounce + 2u;
    float cos_lit = abs(dot(there.wo, there.surface.geometric_normal));
    // Points in one place are on one surface, or their distance is lost to rounding.
    if (bounces < push.least_bounces || bounces > push.most_bounces || !(squared > 0.0) || !(cos_lit > 0.0)) {
        return vec3(0.0);
    }
    vec3 wi = way * inversesqrt(squared);
    vec4 here = vec4(0.0);
    vec4 lit = vec4(0.0);
    float here_back = 0.0;
    float lit_on = 0.0;
    uint look_up = LOOK_UP_EYE;
    do {
        bool at_eye = look_up < LOOK_UP_LIGHT_BACK;
        vec3 across = at_eye ? wi : -wi;
        vec3 along = at_eye ? r.arrival.wo : there.wo;
        bool comes_along = look_up == LOOK_UP_EYE || look_up == LOOK_UP_LIGHT;
        Arrival end = there;
        if (at_eye) {
            end = r.arrival;
        }
        vec4 found = scattering(end, comes_along ? along : across, comes_along ? across : along);
        here = look_up == LOOK_UP_EYE ? found : here;
        here_back = look_up == LOOK_UP_EYE_BACK ? found.a : here_back;
        lit = look_up == LOOK_UP_LIGHT_BACK ? found : lit;
        lit_on = found.a;
        look_up += 1u;
    } while (look_up < LOOK_UPS);
    float cos_there = abs(dot(wi, there.surface.geometric_normal));
    vec3 found = here.rgb * lit.rgb * vertex.power * (cos_there / (cos_lit * squared));
    if (found == vec3(0.0)) {
        return vec3(0.0);
    }
    if (STRATEGY == STRATEGY_COMBINED) {
        float to_light = here.a * surface_cos(there, wi) / squared * mis_behind(vertex.weights, lit.a);
        float to_eye = lit_on * surface_cos(r.arrival, wi) / squared * mis_behind(r.weights, here_back);
        found *= mis_weight(to_light, to_eye);
    }
    if (HAS_ABSORPTION) {
        bool inwards = dot(wi, s.geometric_normal) < 0.0;
        uint passed = r.arrival.solid ? (inwards ? s.material : OUTSIDE) : r.interior;
        found = absorbed(found, passed, sqrt(squared));
    }
    vec3 end;
    shadow_segment(s.point, s.geometric_normal, there.surface.point, there.surface.geometric_normal, ray.origin, end);
    ray.direction = end;
    return finite_or_black(found);
}

// Goes on with the connections of a place.
void connect(Receiver r, uint slot, inout ConnectionState at, out uint rays) {
    rays = 0u;
    bool stopped = false;
    do {
        uvec4 words = connection_words(slot, r.bounce, at.next);
        uint index;
        uint low;
        umulExtended(words.x, push.vertices, index, low);
        Ray ray;
        vec3 found = connection(r, load_light_vertex(index), ray);
        if (found != vec3(0.0)) {
            rays += at.cursor == INDEX_START ? 1u : 0u;
            if (HAS_ALPHA) {
                candidate_key = words;
            }
            Hit hit = no_hit(ray.t_max);
            at.cursor = any_hit(ray, at.cursor, hit);
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
