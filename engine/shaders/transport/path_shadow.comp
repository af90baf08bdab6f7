#version 460
// Wavefront path tracer: adds what light sampling found wherever nothing stands in between.
//
// Stopped rays stall the wave as in path_extend.comp.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/path_buffers.glsl"
#include "accel/bvh2.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_EXTEND || place >= status.active_count || (flags[place] & FLAG_SHADOW) == 0u) {
        return;
    }
    uint resume = resume_words[2u * place + 1u];
    if (resume == BVH2_FINISHED) {
        return;
    }
    ShadowRay s = shadow[place];
    Hit hit = no_hit(s.ray.t_max);
    resume = any_hit(s.ray, resume, hit);
    resume_words[2u * place + 1u] = resume;
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_SHADOW);
    } else if (hit.triangle == NO_HIT) {
        paths[queue_in[place]].radiance += s.contribution;
    }
}
