#version 460
// Reduction of 32-bit words: their sum as 64 bits, their minimum or their maximum.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/reduce.glsl"
#include "kernels/words.glsl"

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer ReduceWords { uint reduce_words[]; };
// Low and high word.
layout(set = 0, binding = 2, scalar) restrict writeonly buffer ReduceResult { uint reduce_result[2]; };

#define TEAM_TYPE uvec2
#define TEAM_IDENTITY words_identity(OPERATION)
#define TEAM_COMBINE(earlier, later) words_combine(OPERATION, earlier, later)
#include "kernels/team_scan.glsl"

void main() {
    uvec3 range = reduce_range(push.plan);
    uvec2 part = TEAM_IDENTITY;
    for (uint at = range.x; at < range.y; at += range.z) {
        uvec2 value = LAST ? uvec2(scratch[2u * at], scratch[2u * at + 1u]) : uvec2(reduce_words[at], 0u);
        part = TEAM_COMBINE(part, value);
    }
    uvec2 total = part;
    if (!SERIAL || LAST) {
        team_exclusive(part, total);
    }
    if (reduce_lane() != 0u) {
        return;
    }
    if (LAST) {
        reduce_result[0] = total.x;
        reduce_result[1] = total.y;
    } else if (reduce_team() < push.plan.max_teams) {
        scratch[2u * reduce_team()] = total.x;
        scratch[2u * reduce_team() + 1u] = total.y;
    }
}
