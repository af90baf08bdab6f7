#version 460
// Where light subpaths have arrived: a vertex that others may be joined to, wherever light is scattered into more than one direction, and one direction more.
// A walk goes on with the probability that leaves its largest band as it is. What it scatters is what an eye would see (bdpt_both_ways.glsl). In scenes with media what happens on the
// way comes before (bdpt_walk_medium.comp).
//
// Veach 1997, 10; I. Georgiev, "Implementing Vertex Connection and Merging", 2012. Deterministic in (seed, pass, walk).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_walk_states.glsl"
#include "techniques/bidirectional/bdpt_new_vertex.glsl"
#include "walk/hand_on.glsl"
#include "techniques/bidirectional/bdpt_both_ways.glsl"
#include "transport/adjoint_ratio.glsl"
#include "transport/bsdf_label.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint last_bounce;  // greatest number of scatterings before a vertex
    vec3 scene_upper;
    uint group;        // walks of one
    WalkKey key;       // the sequence is the pass, places in it walks
} push;

#include "walk/draws.glsl"
#include "walk/survival.glsl"

// Share of what is scattered from a direction to another that a lobe has, of which the walk is given one: drawn in proportion to what the lobes scatter that way, where what comes before
// depends on which it is (transport/bsdf_label.glsl). `states` become those of the walk behind. `u` is used and, for further use, made uniform again.
vec3 labelled(Arrival a, vec3 wi, vec3 whole, uint lobe, inout uint states, inout float u) {
    const uint base = LOBE_DIFFUSE & LOBE_REFLECTION;
    const uint microfacets = LOBE_GLOSSY & LOBE_REFLECTION;
    uint of_base = states_before(states, base);
    uint of_microfacets = states_before(states, microfacets);
    if ((lobe & (base | microfacets)) == 0u || of_base == of_microfacets) {
        states = states_before(states, lobe);
        return whole;
    }
    vec3 diffuse = min(scattering_by(a, wi, a.wo, base).rgb, whole);
    vec3 glossy = whole - diffuse;
    float d = largest_component(diffuse);
    float p = d / max(d + largest_component(glossy), LABEL_LEAST);
    bool chosen = choose_first(u, p);
    states = chosen ? of_base : of_microfacets;
    return chosen ? diffuse / p : glossy / (1.0 - p);
}

// Scatters the walk of a slot at its hit; true when it goes on.
bool scatter(uint slot, uint place, WalkState walk, inout uint flags) {
    Hit hit = load_hit(place);
    if (hit.triangle == NO_HIT || walk.throughput == vec3(0.0)) {
        return false;
    }
    Arrival a = arrival_at(hit, walk.direction, push.scene_lower, push.scene_upper);
    if (arrival_is_unlit(a)) {
        return false;
    }
    if (HAS_ABSORPTION && !HAS_MEDIA) {
        walk.throughput = absorbed(walk.throughput, arrival_interior(a, walk_gathered[slot].interior), hit.t);
    }
    bool from_infinity = walk.bounce == 0u && walk.pdf > 0.0;
    PartialWeights weights = mis_arrive(subpath_weights[slot], from_infinity ? 1.0 : hit.t * hit.t, surface_cos(a, a.wo));
    uint states = walk_states(walk);
    if (arrival_has_rough_lobes(a) && states_before(states, LOBE_DIFFUSE | LOBE_GLOSSY) != 0u) {
        uint history = pack_history(walk.bounce, walk_index(slot) / push.group, states);
        store_light_vertex(place, uvec3(floatBitsToUint(hit.barycentrics), hit.triangle), NO_MEDIUM, history, walk, weights);
        flags |= FLAG_WAITING;
    }
    if (walk.bounce >= push.last_bounce) {
        return false;
    }
    Bsdf bsdf = a.bsdf;
    bsdf.flags |= BSDF_IMPORTANCE;
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    vec2 side = bounce_sample(slot, walk.bounce, DIMENSION_SIDE);
    BsdfSample scattered = bsdf_sample(bsdf, frame.wo, vec3(bounce_sample(slot, walk.bounce, DIMENSION_DIRECTION), side.x), LOBE_ALL);
    vec3 wi = frame_to_world(frame, scattered.wi);
    if (scattered.flags == 0u || !sides_agree(frame.z, frame.outward, wi)) {
        return false;
    }
    float cos_in = abs(dot(a.wo, a.surface.geometric_normal));
    float cos_out = surface_cos(a, wi);
    if (!(cos_in > 0.0)) {
        return false;
    }
    vec3 share;
    if (scattered.pdf > 0.0) {
        vec4 back = scattering(a, wi, a.wo);
        if (HAS_PATH_AUTOMATON) {
            back.rgb = labelled(a, wi, back.rgb, scattered.flags, states, side.y);
        }
        share = back.rgb * (abs(dot(wi, a.surface.geometric_normal)) / (cos_in * scattered.pdf));
        weights = mis_scatter(weights, cos_out, scattered.pdf, back.a);
    } else {
        float ratio = delta_ratio(a, frame, scattered, wi);
        if (ratio == 0.0) {
            return false;
        }
        share = scattered.weight;
        states = states_before(states, scattered.flags);
        if (HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) {
            share *= adjoint_ratio(frame.z, a.surface.geometric_normal, a.wo, wi);
        }
        weights = mis_scatter_delta(weights, cos_out, ratio);
    }
    if (HAS_PATH_AUTOMATON && states == 0u) {
        return false;
    }
    vec3 power = walk.throughput * share;
    float survival = walk_survival(walk.throughput, power, walk.bounce);
    // Also ends a walk whose power is not a number.
    if (!(side.y < survival)) {
        return false;
    }
    if (HAS_TRANSMISSION && (scattered.flags & LOBE_TRANSMISSION) != 0u && (bsdf.flags & BSDF_THIN) == 0u) {
        walk_gathered[slot].interior = frame.wo.z > 0.0 ? a.surface.material : HAS_MEDIA ? a.surface.around : OUTSIDE;
    }
    walk.throughput = power / survival;
    walk.origin = departure(a, wi, walk.throughput);
    walk.direction = normalize(wi);
    walk.bounce += 1u;
    walk.pdf = 0.0;
    walk.eta_scale = states_of_walk(states);
    subpath_weights[slot] = weights;
    store_walk(slot, walk, HAS_MEDIA ? -way_left_out(a.surface, walk.origin, walk.direction) : 0.0);
    return true;
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled != STALLED_NOT || place >= status.active_count) {
        return;
    }
    uint slot = load_slot(place);
    uint flags = 0u;
    WalkState walk = load_walk(slot);
    if (HAS_MEDIA) {
        MediumEvent event = walk_medium_events[place];
        if ((event.flags & EVENT_HANDLED) != 0u) {
            return;
        }
        walk.throughput *= event.weight;
    }
    if (scatter(slot, place, walk, flags)) {
        flags |= FLAG_ALIVE;
    }
    walk_flags_out[place] = flags;
}
