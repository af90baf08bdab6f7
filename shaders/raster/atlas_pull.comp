#version 460
// A coarser level of all maps: the mean distance of the nearest of four texels and those of its surface; empty where they are.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/splat_atlas.glsl"

layout(push_constant, scalar) uniform Push {
    AtlasLevel fine;
    AtlasLevel coarse;  // half of its side
    uint first_map;
    uint maps;
} push;

layout(set = 0, binding = 0, scalar) restrict buffer AtlasTexels { uint atlas_texels[]; };

void main() {
    uint index = invocation_index();
    uint side = push.coarse.side;
    if (index >= push.maps * side * side) {
        return;
    }
    uint map = push.first_map + index / (side * side);
    ivec2 at = ivec2(index % side, index / side % side);
    uint found[4];
    uint nearest = ATLAS_EMPTY;
    for (int child = 0; child < 4; ++child) {
        found[child] = atlas_texels[atlas_texel(push.fine, map, 2 * at + ivec2(child & 1, child >> 1))];
        nearest = min(nearest, found[child]);
    }
    if (nearest != ATLAS_EMPTY) {
        float farthest = (1.0 + ATLAS_SAME_SURFACE) * uintBitsToFloat(nearest);
        float sum = 0.0;
        float count = 0.0;
        for (int child = 0; child < 4; ++child) {
            float distance = uintBitsToFloat(found[child]);
            bool is_same = distance <= farthest;
            sum += is_same ? distance : 0.0;
            count += is_same ? 1.0 : 0.0;
        }
        nearest = floatBitsToUint(sum / count);
    }
    atlas_texels[atlas_texel(push.coarse, map, at)] = nearest;
}
