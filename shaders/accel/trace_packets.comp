// As trace_rays.comp, in the wide hierarchy, where the rays of a subgroup go together: those that the quota stops are left to that kernel.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require

#include "accel/trace_ray.glsl"
#include "accel/wide_packet.glsl"

layout(local_size_x = 64) in;

void main() {
    uint place = gl_GlobalInvocationID.x;
    bool has_ray = place < trace_constants.ray_count;
    uint index = trace_constants.first_ray + min(place, trace_constants.ray_count - 1u);
    Ray ray = trace_rays[index];
    Hit hit = no_hit(ray.t_max);
    uint resume = wide_packet(ray, has_ray, TRACE_ANY, hit);
    if (has_ray) {
        trace_hits[index] = hit;
        trace_resume[index] = resume;
        trace_account(resume == INDEX_FINISHED ? 0u : 1u);
    }
}
