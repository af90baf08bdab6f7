#version 460
// Rays of eye paths along photons' second flights: what each is chosen to stand for counts where nothing is in between, boundaries of media among all else, since planes lie in one body.
//
// Rays that their quota stops, or that are left for later, stall the wave as an arrival stage does, and go on when it is recorded again; those of queries that went through all
// records are told so (`goes_on`), and are counted instead. What is seen on surfaces waits for them, so that a
// pixel, which has one writer, has a sum of one order.
//
// B. Bitterli and W. Jarosz, "Beyond Points and Beams: Higher-Dimensional Photon Samples for Volumetric Light Transport", 2017. Deterministic in (seed, pixel, sample) and the map.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/candidates.glsl"
#include "techniques/photon_mapping/photon_plane_ray.glsl"
#include "techniques/photon_mapping/photon_query_state.glsl"

layout(set = 3, binding = 0, scalar) restrict buffer PhotonPlaneRays { PlaneRay plane_rays[]; };
layout(set = 3, binding = 1, scalar) restrict buffer PlaneRayCounters {
    uint remaining;  // rays of a sweep that are not at their ends
    uint rays[2];    // that are: 64 bits, the low word first
} plane_ray_counters;

// Stands for the bounce in the key of what rays meet by chance, so that those of shadow rays do not return.
const uint CANDIDATES_PLANE = 0x40000000u;

void main() {
    uint place = gl_GlobalInvocationID.x;
    bool has_arrived = status.stalled != STALLED_EXTEND && status.stalled != STALLED_SHADOW;
    if (!has_arrived || place >= status.active_count || plane_rays[place].resume == PLANE_RAY_ENDED) {
        return;
    }
    bool sweeps = push.goes_on != 0u;
    if (!sweeps && !has_work_left()) {
        leave_for_later(STALLED_ARRIVAL);
        return;
    }
    uint slot = load_slot(place);
    PlaneRay ray = plane_rays[place];
    begin_candidates(slot, walk_round(slot) | CANDIDATES_PLANE, CANDIDATES_SHADOW);
    Hit hit = no_hit(ray.reach);
    uint resume = any_hit(Ray(ray.origin, 0.0, ray.direction, ray.reach), ray.resume, hit);
    plane_rays[place].resume = resume;
    count_work(index_iterations, WORK_LEAST);
    if (resume != INDEX_FINISHED) {
        if (sweeps) {
            atomicAdd(plane_ray_counters.remaining, 1u);
        } else {
            leave_for_later(STALLED_ARRIVAL);
        }
        return;
    }
    COUNT_WIDE(plane_ray_counters.rays, 1u)
    if (!sweeps) {
        walk_resume[place] = BEAM_DONE;
    }
    if (hit.triangle == NO_HIT) {
        walk_gathered[slot].radiance += ray.color * ray.total;
    }
}
