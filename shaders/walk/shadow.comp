#version 460
// The shadow stage of a wave: adds to what walks have gathered what their shadow rays carry, wherever nothing stands in between; in scenes with
// media, as much of it as the media let through.
//
// Rays that are stopped or left for later stall the wave as in extend.comp.
// variant: driver
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "walk/candidates.glsl"
#include "walk/shadow_media.glsl"

// Whether light passes, and nothing else.
void trace_shadow_ray(uint place, uint resume, bool begun) {
    count_fetches(1u, 1u);
    ShadowRay s = load_shadow_ray(texelFetch(walk_waiting_queue_in, int(place)).x);
    begin_candidates(s.slot, s.bounce, CANDIDATES_SHADOW);
    Hit hit = no_hit(s.t_max);
    // One that is left for later has no direction, which ends its traversal at once.
    vec3 direction = begun ? s.direction : vec3(0.0);
    uint next = any_hit(Ray(s.origin, 0.0, direction, s.t_max), RESUMES ? resume : INDEX_START, hit);
    resume = begun ? next : resume;
    walk_resume[place] = resume;
    if (resume != INDEX_FINISHED) {
        stall_place(STALLED_SHADOW, begun);
    } else if (hit.triangle == NO_HIT) {
        walk_gathered[s.slot].radiance += s.contribution;
    }
}

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || place >= status.waiting_count) {
        return;
    }
    uint resume = push.goes_on != GOES_ON_NOT ? walk_resume[place] : INDEX_START;
    if (resume == INDEX_FINISHED) {
        return;
    }
    bool begun = has_work_left();
    if (HAS_MEDIA) {
        trace_shadow_rays_through_media(place, resume, begun);
    } else {
        trace_shadow_ray(place, resume, begun);
    }
    count_work(index_iterations + GRID_ITERATION_WORK * grid_iterations, WORK_LEAST);
    add_fetches(FETCHES_SHADOW);
}
