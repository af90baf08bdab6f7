#version 460
// A coarser level of pyramids of sums: each texel has that of four.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/atlas_level.glsl"

layout(push_constant, scalar) uniform Push {
    AtlasLevel fine;
    AtlasLevel coarse;  // half of its side
    uint maps;
} push;

layout(set = 0, binding = 0, scalar) restrict buffer FluxSums { float flux_sums[]; };

void main() {
    uint index = invocation_index();
    uint side = push.coarse.side;
    if (index >= push.maps * side * side) {
        return;
    }
    uint map = index / (side * side);
    ivec2 at = ivec2(index % side, index / side % side);
    float sum = 0.0;
    for (int child = 0; child < 4; ++child) {
        sum += flux_sums[atlas_texel(push.fine, map, 2 * at + ivec2(child & 1, child >> 1))];
    }
    flux_sums[atlas_texel(push.coarse, map, at)] = sum;
}
