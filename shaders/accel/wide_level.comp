// Before each level of the wide hierarchy's build, one invocation: where it ends in the list of nodes, and the arguments of its dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/wide_build.glsl"

layout(local_size_x = 1) in;

layout(set = 0, binding = 0, scalar) restrict buffer WideStateBlock { WideState wide_state; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer WideArguments { uint wide_arguments[3]; };

layout(push_constant, scalar) uniform WideLevelPush { uint level; } wide_push;

void main() {
    uint level = wide_push.level;
    uint listed = wide_state.listed;
    uint count = listed - (level == 0u ? 0u : wide_state.ends[max(level, 1u) - 1u]);
    wide_state.ends[level] = listed;
    wide_arguments[0] = (count + LBVH_GROUP_SIZE - 1u) / LBVH_GROUP_SIZE;
    wide_arguments[1] = 1u;
    wide_arguments[2] = 1u;
}
