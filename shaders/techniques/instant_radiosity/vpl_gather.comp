#version 460
// Radiance from the virtual lights of a pass where eye paths have arrived, at surfaces that scatter into more than one direction: the scattering functions at
// both ends, the geometry term between them up to its bound, and a shadow ray. From all lights; from those that carry a share of the sum of what all would bring
// if nothing stood between; or from one below each node of a cut through a tree of them, over its probability.
//
// An invocation is for a place, and takes the lights in their order, so many a dispatch. A place that has not had all of them, or whose ray a quota stops,
// notes where it is, marks itself and stalls the wave; further dispatches go on there. Places that are left for later, since the submission's work is used up,
// stall the wave before they begin. Sums are kept between dispatches, so that they are the same bits however lights are shared out among them; a cut
// is made anew in each.
//
// SVO-G0, BG-8, BG-10, MET-V1: A. Keller, "Instant Radiosity", 1997; T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", 2006.
// MET-V4, MET-V7: a share of the potential. CL-VPL-CUTS: C. Yuksel, "Stochastic Lightcuts", 2019.
// CL-VPL-RESAMPLED: J. Talbot et al., "Importance Resampling for Global Illumination", 2005.
// Deterministic: a path's sum has the order of the lights, or of the cut's nodes.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "walk/wave.glsl"
#include "transport/path_set.glsl"
#include "wide_counter.glsl"
#include "transport/random.glsl"
#include "techniques/instant_radiosity/gather_place.glsl"
#include "techniques/instant_radiosity/potential_bins.glsl"
#include "techniques/instant_radiosity/resampling.glsl"
#include "transport/luminance.glsl"
#include "walk/candidate_alpha.glsl"

#define CLERESTORY_CANDIDATE_FILTER HAS_ALPHA
#include "accel/index.glsl"

// Nodes that the invocation has looked at.
uint light_nodes_read = 0u;

SceneLightNode load_cut_node(uint index) {
    ++light_nodes_read;
    int first = int(LIGHT_NODE_QUARTERS * index);
    vec4 q0 = uintBitsToFloat(texelFetch(light_node_texels, first));
    vec4 q1 = uintBitsToFloat(texelFetch(light_node_texels, first + 1));
    vec4 q2 = uintBitsToFloat(texelFetch(light_node_texels, first + 2));
    uvec4 q3 = texelFetch(light_node_texels, first + 3);
    return SceneLightNode(q0.xyz, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, uintBitsToFloat(q3.x), uintBitsToFloat(q3.y), q3.z, q3.w);
}

#define CLERESTORY_LIGHT_NODE load_cut_node
#define CLERESTORY_LIGHT_GEOMETRY_MOST push.geometry_most
#include "transport/light_cut.glsl"

// Of SELECT_POTENTIAL: what the lights of each bin carry.
float carried_potentials[POTENTIAL_BINS];

// Tells what lights of a cut are chosen by.
const uint CUT_SEED = 0x76706c63u;

// The normal that the choice of lights takes a receiver to have; zero where light comes from all sides.
vec3 receiver_normal(Receiver r) { return HAS_TRANSMISSION && r.arrival.material.transmission > 0.0 ? vec3(0.0) : r.frame.z; }

// Luminance of a potential contribution, W/(m2 sr) of a pass.
float potential_key(vec3 found) { return dot(found, LUMINANCE.rgb) * push.scale; }

// What a light brings if nothing stands between; nothing where the picture has not its number of scatterings.
vec3 counted_connection(Receiver r, VirtualLight light, out Ray ray) {
    vec3 found = connection(r, light, ray);
    return counts_bounces(r.bounce + light.bounce + 2u) ? found : vec3(0.0);
}

// What a light below a node of the cut brings if nothing stands between, over the probability of its choice: of so many candidates one is kept by what they would
// bring, and stands for them all.
vec3 resampled_connection(Receiver r, uint place, vec3 normal, out Ray ray) {
    vec3 kept = vec3(0.0);
    float of_kept = 0.0;
    float sum = 0.0;
    for (uint candidate = 0u; candidate < push.candidates; ++candidate) {
        uvec4 words = connection_words(r, candidate * LIGHT_CUT_MAX + place, CUT_SEED);
        float probability;
        uint number = light_cut_sample(place, r.arrival.surface.point.position, normal, words.x, words.y, probability);
        Ray way;
        vec3 found = counted_connection(r, load_virtual_light(number), way) / probability;
        float weight = dot(found, LUMINANCE.rgb);
        if (resample(unit_float(words.z), weight, sum)) {
            kept = found;
            of_kept = weight;
            ray = way;
        }
    }
    // Exactly itself where it is alone.
    return kept * ((sum == of_kept ? 1.0 : sum / of_kept) / float(push.candidates));
}

// Finds the least potential that a place takes, so that its lights carry a share of the sum, and the rescaling that stands for the others.
void select_by_potential(Receiver r, uint place) {
    for (uint bin = 0u; bin < POTENTIAL_BINS; ++bin) {
        carried_potentials[bin] = 0.0;
    }
    float total = 0.0;
    for (uint number = 0u; number < push.lights; ++number) {
        Ray ray;
        float key = potential_key(counted_connection(r, load_virtual_light(number), ray));
        carried_potentials[potential_bin(key)] += key;
        total += key;
    }
    // From the strongest bin on.
    float taken = 0.0;
    uint bin = POTENTIAL_BINS;
    for (uint step = 0u; step < POTENTIAL_BINS && (push.share >= 1.0 || taken < push.share * total); ++step) {
        --bin;
        taken += carried_potentials[bin];
    }
    uint words = push.first_selected + 2u * place;
    selected_lights[words] = potential_bin_least(bin);
    selected_lights[words + 1u] = push.rescales != 0u && bin > 0u && taken > 0.0 ? total / taken : 1.0;
}

// Goes on with the lights of a place, of which there are `count`, by the normal that they are chosen by, or the least potential of those that are taken.
void gather(Receiver r, uint count, vec3 normal, float least, inout GatherState at, out uint rays) {
    rays = 0u;
    uint last = min(at.light + LIGHTS_AT_ONCE, count);
    bool stopped = false;
    do {
        Ray ray;
        vec3 found;
        if (SELECTION == SELECT_CUTS) {
            found = resampled_connection(r, at.light, normal, ray);
        } else {
            found = counted_connection(r, load_virtual_light(at.light), ray);
        }
        bool counts = found != vec3(0.0);
        if (SELECTION == SELECT_POTENTIAL) {
            counts = counts && potential_key(found) >= least;
        }
        if (counts) {
            rays += at.cursor == INDEX_START ? 1u : 0u;
            if (HAS_ALPHA) {
                candidate_key = connection_words(r, at.light, LIGHT_RAY_SEED);
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
    if (goes_on ? resume != LIGHTS_STOPPED : resume == LIGHTS_STOPPED || resume == LIGHTS_DONE) {
        return;
    }
    if (!goes_on && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    walk_resume[place] = LIGHTS_DONE;
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
    uint count = push.lights;
    vec3 normal = receiver_normal(r);
    float least = 0.0;
    float rescaling = 1.0;
    if (SELECTION == SELECT_CUTS) {
        count = light_cut(r.arrival.surface.point.position, normal, push.cut_size);
    }
    if (SELECTION == SELECT_POTENTIAL) {
        if (!goes_on) {
            select_by_potential(r, place);
        }
        least = selected_lights[push.first_selected + 2u * place];
        rescaling = selected_lights[push.first_selected + 2u * place + 1u];
    }
    uint first = at.light;
    uint rays;
    gather(r, count, normal, least, at, rays);
    uint candidates = SELECTION == SELECT_CUTS ? push.candidates : 1u;
    COUNT_WIDE(gather_counters.connections, candidates * (at.light - first))
    COUNT_WIDE(gather_counters.shadow_rays, rays)
    if (SELECTION == SELECT_CUTS) {
        COUNT_WIDE(gather_counters.nodes, light_nodes_read)
    }
    if (!goes_on) {
        uint connections = candidates * LIGHTS_AT_ONCE + (SELECTION == SELECT_POTENTIAL ? push.lights : 0u);
        count_work(index_iterations + CONNECTION_ITERATIONS * connections, WORK_UNIT);
    }
    if (at.light == count) {
        walk_gathered[slot].radiance += r.throughput * at.sum * (push.scale * rescaling);
        return;
    }
    gather_states[place] = at;
    walk_resume[place] = LIGHTS_STOPPED;
    if (goes_on) {
        atomicAdd(gather_counters.remaining, 1u);
    } else {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
    }
}
