#version 460
// Radiance from the photon map where eye paths have arrived, at surfaces with a diffuse base: the kernels that hold the point, each times the
// scattering function between the photon's way and the path's.
//
// A query is one loop, in which a step is a node or a record. One that its quota stops leaves nothing, marks its place and stalls the wave:
// such places go through all records instead (LINEAR), so many a dispatch.
//
// PM-DE-1, PM-DE-4, PM-DE-5, PM-ST-5: "Interactive Manycore Photon Mapping", 2011, §3.4.2, §5.2 and §6.2.3. Deterministic: a path's sum has the order
// of the map's leaves, or of its records.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/path_features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_map.glsl"
#include "scene/bindings.glsl"
#include "transport/path_buffers.glsl"
#include "transport/path_set.glsl"
#include "transport/surface.glsl"

layout(constant_id = 42) const uint PROFILE = KERNEL_EPANECHNIKOV;
layout(constant_id = 43) const bool LINEAR = false;        // goes through records, for places that have stopped
layout(constant_id = 44) const bool COUNTS_BOUNCES = false;  // the path set bounds the number of scatterings

// Stands in path_resume for a query that its quota stopped.
const uint GATHER_STOPPED = 0xFFFFFFFEu;
// Photons count where their surface's normal is less than 60 degrees from that of the point: not through thin walls nor around corners.
const float PHOTON_NORMAL_COS_MIN = 0.5;

// What the query under way is about.
struct Gather {
    vec3 position;
    vec3 facing;      // geometric normal, to the viewer's side
    vec3 z;           // of the scattering frame
    vec3 outward;     // geometric normal on the side of z
    Bsdf bsdf;
    CosineLobes lobes;
    uint bounce;      // scatterings between the point and the eye
    bool caustics;    // photons that were never scattered diffusely are the only ones that count
};
Gather gather;
vec3 gathered;
uint gathered_photons;

// A photon's scattering function times the kernel; what all photons have in common is left to the end.
bool compact_visit_point(uint record);

#define COMPACT_POINT
#include "accel/compact_bvh.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint gather_states;   // states of a path whose diffuse surfaces gather, a bit each
    vec3 scene_upper;
    uint caustic_states;  // those that gather photons not scattered diffusely alone
    CompactRoot root;
    uint least_bounces;   // scatterings in all, with that at the point
    uint most_bounces;
    float scale;          // of stored fluxes
    uint first;           // of the records that a linear query goes through
    uint last;
} push;

// Where all photons are scattered alike, up to their kernels.
const bool LAMBERT = !HAS_SPECULAR_LAYER && !HAS_SHADING_NORMALS && !HAS_NORMAL_MAPS;

bool compact_visit_point(uint record) {
    uvec4 q0 = photon_quarter(record, 0u);
    uvec4 q1 = photon_quarter(record, 1u);
    uvec4 q2 = photon_quarter(record, 2u);
    float weight = photon_weight(PROFILE, q0, q1, q2, gather.position, gather.facing, PHOTON_NORMAL_COS_MIN);
    if (TELLS_CAUSTICS && gather.caustics && photon_is_diffused(q0)) {
        weight = 0.0;
    }
    if (COUNTS_BOUNCES) {
        uint bounces = photon_bounce(q1) + 1u + gather.bounce;
        weight = bounces < push.least_bounces || bounces > push.most_bounces ? 0.0 : weight;
    }
    if (weight > 0.0) {
        vec3 flux = photon_flux(q2);
        ++gathered_photons;
        if (LAMBERT) {
            gathered += weight * flux;
        } else {
            vec3 wi = -photon_direction(q1);
            float cos_i = dot(wi, gather.z);
            float cos_g = dot(wi, gather.outward);
            if (cos_i * cos_g > 0.0 && cos_i > 0.0) {
                gathered += cosine_lobes_eval(gather.bsdf, gather.lobes, cos_i) * flux * (weight * (cos_i / cos_g));
            }
        }
    }
    return !photon_ends_leaf(q0);
}

// Prepares the query of a place; false where nothing is gathered. The throughput is that at the point.
bool begin_gather(uint slot, uint place, out vec3 throughput) {
    PathState path = load_path(slot);
    throughput = path.throughput;
    uint state = HAS_PATH_AUTOMATON ? path_set_state(path.bounce) : 0u;
    gather.bounce = HAS_PATH_AUTOMATON ? path_set_bounce(path.bounce) : path.bounce;
    Hit hit = load_hit(place);
    if ((push.gather_states >> state & 1u) == 0u || hit.triangle == NO_HIT) {
        return false;
    }
    if (COUNTS_BOUNCES && gather.bounce + 1u > push.most_bounces) {
        return false;
    }
    Surface s = surface_at(hit, push.scene_lower, push.scene_upper);
    SceneMaterial m = load_material(s.material);
    vec3 wo = -path.direction;
    bool front = dot(wo, s.geometric_normal) > 0.0;
    bool solid = HAS_TRANSMISSION && m.transmission > 0.0 && m.thickness > 0.0;
    gather.bsdf = surface_bsdf(m, s);
    if ((HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u) || !bsdf_has_diffuse_base(gather.bsdf, solid && !front)) {
        return false;
    }
    if (HAS_ABSORPTION) {
        uint interior = path_gathered[slot].interior;
        interior = interior == OUTSIDE && solid && !front ? s.material : interior;
        if (interior != OUTSIDE) {
            throughput *= exp(-load_material(interior).absorption * hit.t);
        }
    }
    gather.position = s.point.position;
    gather.facing = front ? s.geometric_normal : -s.geometric_normal;
    vec3 outward = solid ? s.geometric_normal : gather.facing;
    vec3 normal = gather.facing;
    if (HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) {
        normal = adapt_shading_normal(surface_mapped_normal(m, s), gather.facing, wo);
    }
    // The base scatters on the viewer's side alone.
    gather.z = normal;
    gather.outward = gather.facing;
    gather.lobes = cosine_lobes(gather.bsdf, max(dot(wo, normal), 0.0), false, LOBE_DIFFUSE);
    gather.caustics = (push.caustic_states >> state & 1u) != 0u;
    return true;
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    if (LINEAR && path_resume[place] != GATHER_STOPPED) {
        return;
    }
    uint slot = load_slot(place);
    vec3 throughput;
    if (!begin_gather(slot, place, throughput)) {
        return;
    }
    gathered = vec3(0.0);
    gathered_photons = 0u;
    if (LINEAR) {
        for (uint record = push.first; record < push.last; ++record) {
            compact_visit_point(record);
        }
    } else if (!compact_point_query(push.root, gather.position)) {
        path_resume[place] = GATHER_STOPPED;
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_ARRIVAL);
        return;
    }
    if (LAMBERT) {
        gathered *= gather.lobes.diffuse * INV_PI;
    }
    if (!LINEAR || push.first == 0u) {
        atomicAdd(gather_counters.queries, 1u);
    }
    if (atomicAdd(gather_counters.photons[0], gathered_photons) > 0xFFFFFFFFu - gathered_photons) {
        atomicAdd(gather_counters.photons[1], 1u);
    }
    path_gathered[slot].radiance += throughput * gathered * push.scale;
}
