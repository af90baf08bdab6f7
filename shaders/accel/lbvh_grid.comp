// Second stage of the linear hierarchy, one invocation: the grid of the codes over the bounds that the first stage has found.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/morton.glsl"

layout(local_size_x = 1) in;

layout(constant_id = 0) const uint LBVH_AXIS_BITS = 10u;

layout(set = 0, binding = 0, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

void main() {
    int least[3] = lbvh_state.centres_lower;
    int greatest[3] = lbvh_state.centres_upper;
    vec3 lower = ordered_floats(ivec3(least[0], least[1], least[2]));
    precise vec3 extent = ordered_floats(ivec3(greatest[0], greatest[1], greatest[2])) - lower;
    lbvh_state.grid_lower = lower;
    for (uint axis = 0u; axis < 3u; ++axis) {
        lbvh_state.grid_scale[axis] = cells_per_length(extent[axis], LBVH_AXIS_BITS);
    }
}
