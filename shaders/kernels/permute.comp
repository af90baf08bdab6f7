#version 460
// Gather (element i from the place that index i names) or scatter (element i to that place) of elements of some words. Indices out of range are counted;
// a gather then gives zeros, a scatter writes nothing.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;
// Words of an element.
layout(constant_id = 1) const uint ELEMENT_WORDS = 1u;
layout(constant_id = 2) const bool SCATTER = false;

#include "kernels/stream_scratch.glsl"

layout(push_constant, scalar) uniform Push {
    StreamPlan plan;
    uint places;  // elements of the buffer that is indexed
} push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer PermuteIndices { uint permute_indices[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer PermuteIn { uint permute_in[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer PermuteOut { uint permute_out[]; };
// How many indices were out of range.
layout(set = 0, binding = 4, scalar) restrict buffer PermuteFaults { uint permute_faults[]; };

void main() {
    uint count = stream_size(push.plan);
    uvec2 range = stream_range(gl_WorkGroupID.x, count, stream_block(count, push.plan.tile, push.plan.max_teams));
    for (uint at = range.x + gl_LocalInvocationID.x; at < range.y; at += gl_WorkGroupSize.x) {
        uint index = permute_indices[at];
        bool inside = index < push.places;
        if (!inside) {
            atomicAdd(permute_faults[0], 1u);
        }
        uint from = ELEMENT_WORDS * (SCATTER ? at : index);
        uint to = ELEMENT_WORDS * (SCATTER ? index : at);
        for (uint word = 0u; word < ELEMENT_WORDS; ++word) {
            if (inside || !SCATTER) {
                permute_out[to + word] = inside ? permute_in[from + word] : 0u;
            }
        }
    }
}
