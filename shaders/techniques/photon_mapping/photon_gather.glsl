// Radiance from the photon map where eye paths have arrived, at surfaces with a diffuse base: the kernels that hold the point, each times the
// scattering function between the photon's way and the path's; or the nearest photons, under one kernel as wide as the last of them is away.
//
// A query is one loop, in which a step is a node or a record. With COMPACT_PACKET defined a subgroup goes through the map together,
// wherever any of its points lies; the sums are the same bits, as each point meets its kernels in the same order. A query that its quota stops
// leaves nothing, marks its place and stalls the wave: such places go through all records instead (LINEAR), so many a dispatch, whatever queue they
// came from. Queries that are left for later, since the submission's work is used up, stall the wave before they begin.
//
// PM-DE-1, PM-DE-3 to PM-DE-5, PM-ST-5, PM-ST-6: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §3.4.2, §5.2, §6.2.3 and §7.4.2. Deterministic: a
// path's sum has the order of the map's leaves, or of its records.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_GATHER_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_GATHER_GLSL

#include "techniques/photon_mapping/photon_asks.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_map.glsl"
#include "techniques/photon_mapping/photon_queue.glsl"

layout(constant_id = 42) const uint PROFILE = KERNEL_EPANECHNIKOV;
layout(constant_id = 43) const bool LINEAR = false;        // goes through records, for places that have stopped
layout(constant_id = 45) const bool NEAREST = false;       // one kernel about the point, up to its `neighbors`-th photon
layout(constant_id = 46) const uint QUEUE = QUEUE_SLOTS;

// Photons count where their surface's normal is less than 60 degrees from that of the point: not through thin walls nor around corners.
const float PHOTON_NORMAL_COS_MIN = 0.5;

// What the query under way is about.
struct Gather {
    vec3 position;
    vec3 facing;      // geometric normal, to the viewer's side
    vec3 z;           // of the scattering frame: the base scatters on the viewer's side alone
    Bsdf bsdf;
    CosineLobes lobes;
    uint bounce;      // scatterings between the point and the eye
    uint classes;     // of photons that count, a bit each, where there are classes
    bool caustics;    // photons that were never scattered diffusely are the only ones that count
};
Gather gather;
vec3 gathered;
uint gathered_photons;

// Photons about the point by their squared distance, of which more rounds see less, but finer.
const uint NEAREST_BINS = 32u;
const uint NEAREST_ROUNDS = 5u;
// How often what is searched is halved, by its area, where there are more photons than a query has steps for.
const uint NEAREST_HALVINGS = 6u;
// Units in the last place of coordinates by which boxes stay wider than what is searched.
const float NEAREST_SLACK = 4.0 / 8388608.0;
// By how much a span's end is widened: places in bins and their limits are rounded apart, and who is last must not lie beyond.
const float NEAREST_WIDENED = 1.0 + 4.0 / 8388608.0;
// Least part of the squared distance that is told apart.
const float NEAREST_PRECISION = 1e-4;
uint nearest_bins[NEAREST_BINS];
vec2 nearest_span;
bool nearest_counts;
float nearest_squared;  // squared distance of the last photon
bool nearest_all;       // there are as many as asked for
float nearest_inset;    // by how much boxes are too wide for what is searched

// Adds a photon's kernel times its scattering function, or counts it; what all photons have in common is left to the end. Whether the leaf
// goes on.
bool compact_visit_point(uint record);

#define COMPACT_POINT
#define COMPACT_LOWER(PLANES) (NEAREST ? (PLANES) + nearest_inset : (PLANES))
#define COMPACT_UPPER(PLANES) (NEAREST ? (PLANES) - nearest_inset : (PLANES))
#include "accel/compact_bvh.glsl"

// Beside the other bindings of the map (photon_map.glsl): in memory, so that the device may have made it.
layout(set = 1, binding = 3, scalar) restrict readonly buffer PhotonMapRoot { CompactRoot photon_map_root; };
// In scenes with media alone; elsewhere some other buffer is bound, and nothing is read.
layout(set = 1, binding = 4, scalar) restrict readonly buffer PhotonBeamWays { BeamWay beam_ways[]; };

layout(push_constant, scalar) uniform Push {
    AskSettings ask;
    uint caustic_states;  // of those that ask, those that gather photons not scattered diffusely alone
    uint least_bounces;   // scatterings in all, with that at the point
    float scale;          // of stored fluxes
    uint neighbors;       // of NEAREST
    float radius;         // within which they are looked for
    uint first_place;     // of LINEAR
    uint first;           // of the records that a linear query goes through
    uint last;
    uint classes[ASKING_STATES];  // by state of a path: those that count on surfaces, and 16 bits higher those that do in media
} push;

// Where all photons are scattered alike, up to their kernels.
const bool LAMBERT = !HAS_SPECULAR_LAYER && !HAS_SHADING_NORMALS && !HAS_NORMAL_MAPS;

bool compact_visit_point(uint record) {
    uvec4 q0 = photon_quarter(record, 0u);
    uvec4 q1 = photon_quarter(record, 1u);
    uvec4 q2 = photon_quarter(record, 2u);
    float weight;
    float squared;
    if (NEAREST) {
        vec3 way = gather.position - uintBitsToFloat(q0.xyz);
        squared = dot(way, way);
        bool held = squared < (nearest_counts ? nearest_span.y : nearest_squared);
        held = held && dot(photon_normal(q0), gather.facing) > PHOTON_NORMAL_COS_MIN;
        weight = held ? kernel_profile(PROFILE, nearest_counts ? 0.0 : squared / nearest_squared) / nearest_squared : 0.0;
    } else {
        weight = photon_weight(PROFILE, q0, q1, q2, gather.position, gather.facing, PHOTON_NORMAL_COS_MIN);
    }
    if (TELLS_CAUSTICS && gather.caustics && photon_is_diffused(q0)) {
        weight = 0.0;
    }
    if (HAS_CLASSES && (gather.classes >> photon_bounce(q1) & 1u) == 0u) {
        weight = 0.0;
    }
    if (COUNTS_BOUNCES) {
        uint bounces = photon_bounce(q1) + 1u + gather.bounce;
        weight = bounces < push.least_bounces || bounces > push.ask.most_bounces ? 0.0 : weight;
    }
    if (NEAREST && nearest_counts) {
        if (weight > 0.0) {
            float place = (squared - nearest_span.x) / (nearest_span.y - nearest_span.x) * float(NEAREST_BINS);
            // What is nearer than the span is in its first bin.
            ++nearest_bins[uint(clamp(place, 0.0, float(NEAREST_BINS - 1u)))];
        }
    } else if (weight > 0.0) {
        vec3 flux = photon_flux(q2);
        ++gathered_photons;
        if (LAMBERT) {
            gathered += weight * flux;
        } else {
            vec3 wi = -photon_direction(q1);
            float cos_i = dot(wi, gather.z);
            // Photons lie as densely as the cosine on their own facet has it.
            float cos_photon = dot(wi, photon_normal(q0));
            if (cos_photon > 0.0 && cos_i > 0.0) {
                gathered += cosine_lobes_eval(gather.bsdf, gather.lobes, cos_i) * flux * (weight * (cos_i / cos_photon));
            }
        }
    }
    return !photon_ends_leaf(q0);
}

// Searches between two squared distances of the point, `radius` away at most.
void search_nearest(vec2 span, float radius) {
    nearest_span = span;
    nearest_squared = span.y;
    float slack = NEAREST_SLACK * largest_component(abs(gather.position));
    nearest_inset = max(radius - sqrt(span.y) - slack, 0.0);
}

// Finds the squared distance of the point's last neighbour among those within `radius`, or that of the radius where there are fewer; false when
// a quota stops it even in the least radius. Where a quota stops it in a larger one, neighbours in the next may be fewer than asked for.
bool find_nearest(float radius) {
    nearest_counts = true;
    nearest_all = false;
    search_nearest(vec2(0.0, radius * radius), radius);
    uint halvings = 0u;
    for (uint round = 0u; round < NEAREST_ROUNDS + halvings && nearest_span.y - nearest_span.x > NEAREST_PRECISION * nearest_span.x; ++round) {
        for (uint i = 0u; i < NEAREST_BINS; ++i) {
            nearest_bins[i] = 0u;
        }
        if (!compact_point_query(photon_map_root, gather.position)) {
            if (halvings == NEAREST_HALVINGS) {
                return false;
            }
            ++halvings;
            nearest_all = false;
            search_nearest(vec2(0.0, 0.5 * nearest_span.y), radius);
            continue;
        }
        uint bin = 0u;
        uint found = nearest_bins[0];
        while (found < push.neighbors && bin + 1u < NEAREST_BINS) {
            found += nearest_bins[++bin];
        }
        float width = (nearest_span.y - nearest_span.x) / float(NEAREST_BINS);
        if (found < push.neighbors) {
            break;
        }
        nearest_all = true;
        float limit = (nearest_span.x + float(bin + 1u) * width) * NEAREST_WIDENED;
        search_nearest(vec2(nearest_span.x + float(bin) * width, min(limit, nearest_span.y)), radius);
    }
    nearest_counts = false;
    return true;
}

// Prepares the query of a place; false where nothing is gathered. The throughput is that at the point.
bool begin_gather(uint slot, uint place, out vec3 throughput) {
    WalkState path = load_walk(slot);
    throughput = path.throughput;
    Arrival a;
    if (!asks_map(push.ask, path, place, a)) {
        return false;
    }
    gather.bounce = asking_bounce(path);
    if (HAS_MEDIA) {
        throughput *= beam_ways[place].surface;
        if (throughput == vec3(0.0)) {
            return false;
        }
    } else if (HAS_ABSORPTION) {
        throughput = absorbed(throughput, arrival_interior(a, walk_gathered[slot].interior), a.distance);
    }
    gather.bsdf = a.bsdf;
    gather.position = a.surface.point.position;
    gather.facing = a.facing;
    gather.z = arrival_normal(a);
    gather.lobes = cosine_lobes(gather.bsdf, max(dot(a.wo, gather.z), 0.0), false, LOBE_DIFFUSE);
    gather.classes = HAS_CLASSES ? push.classes[min(asking_state(path), ASKING_STATES - 1u)] & CLASSES_ON_SURFACES : 0u;
    gather.caustics = (push.caustic_states >> asking_state(path) & 1u) != 0u;
    return true;
}

// Gathers at the point that is prepared; false when a quota stops it.
bool gather_photons() {
    gathered = vec3(0.0);
    gathered_photons = 0u;
    if (LINEAR) {
        for (uint record = push.first; record < push.last; ++record) {
            compact_visit_point(record);
        }
        return true;
    }
    if (NEAREST && !find_nearest(push.radius)) {
        return false;
    }
    return compact_point_query(photon_map_root, gather.position);
}

void main() {
    uint place = gl_GlobalInvocationID.x + (LINEAR ? push.first_place : 0u);
    if (QUEUE != QUEUE_SLOTS) {
        place = queued_place(QUEUE, place);
    }
    if (!wave_has_arrived() || place >= status.active_count
        || (LINEAR && !(HAS_MEDIA ? gather_has_stopped(walk_resume[place]) : walk_resume[place] == GATHER_STOPPED))) {
        return;
    }
    uint resume = walk_resume[place];
    if (!LINEAR) {
        if (HAS_MEDIA ? !beam_is_known(resume) : resume == GATHER_STOPPED || resume == GATHER_DONE) {
            return;
        }
        if (!has_work_left()) {
            leave_for_later(STALLED_ARRIVAL);
            return;
        }
        walk_resume[place] = HAS_MEDIA ? gather_done(resume) : GATHER_DONE;
    }
    uint slot = load_slot(place);
    vec3 throughput;
    if (!begin_gather(slot, place, throughput)) {
        return;
    }
    bool complete = gather_photons();
    if (!LINEAR) {
        count_work(QUERY_STEP_WORK * compact_steps, QUERY_STEP_WORK * WORK_UNIT);
    }
    if (!complete) {
        walk_resume[place] = HAS_MEDIA ? gather_stopped(resume) : GATHER_STOPPED;
        atomicAdd(gather_counters.stopped, 1u);
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
        return;
    }
    if (LAMBERT) {
        gathered *= gather.lobes.diffuse * INV_PI;
    }
    if (NEAREST && PROFILE == KERNEL_UNIFORM && nearest_all) {
        // The last photon only says how wide the kernel is, which others leave out by themselves.
        gathered *= float(push.neighbors - 1u) / float(push.neighbors);
    }
    if (!LINEAR || push.first == 0u) {
        atomicAdd(gather_counters.queries, 1u);
    }
    COUNT_WIDE(gather_counters.photons, gathered_photons)
    walk_gathered[slot].radiance += throughput * gathered * push.scale;
}

#endif
