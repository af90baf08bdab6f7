#version 460
// Second half of a summed-area table: sums down its columns, an invocation per column.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/sat_value.glsl"

layout(push_constant, scalar) uniform Push { uvec2 size; } push;  // of the table

layout(set = 0, binding = 0, scalar) restrict buffer Sums { SatValue sums[]; };

void main() {
    uint x = gl_GlobalInvocationID.x;
    if (x >= push.size.x) {
        return;
    }
    SatValue sum = sums[x];
    for (uint y = 1u; y < push.size.y; ++y) {
        uint at = y * push.size.x + x;
        for (uint c = 0u; c < SAT_CHANNELS; ++c) {
            sum.channel[c] = sat_added(sum.channel[c], sums[at].channel[c]);
        }
        sums[at] = sum;
    }
}
