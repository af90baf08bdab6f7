#version 460
// Wavefront path tracer: the closest hit of every path's ray.
//
// A ray that its quota stops is counted and stalls the wave: the later stages leave at once, and the host runs this stage again, which
// goes on where the ray was.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/path_buffers.glsl"
#include "accel/bvh2.glsl"

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (status.stalled == STALLED_SHADOW || place >= status.active_count) {
        return;
    }
    uint resume = resume_words[2u * place];
    if (resume == BVH2_FINISHED) {
        return;
    }
    Ray ray = rays[queue_in[place]];
    Hit hit = no_hit(ray.t_max);
    if (resume != BVH2_START) {
        hit = hits[place];
    }
    resume = closest_hit(ray, resume, hit);
    hits[place] = hit;
    resume_words[2u * place] = resume;
    if (resume != BVH2_FINISHED) {
        atomicAdd(status.unfinished, 1u);
        atomicMax(status.stalled, STALLED_EXTEND);
    }
}
