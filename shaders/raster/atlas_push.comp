#version 460
// Empty texels of a level of all maps: between the coarser ones about them, as far as those are of the surface of the one that they lie in. Where that is empty
// they stay so.
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
    uint side = push.fine.side;
    if (index >= push.maps * side * side) {
        return;
    }
    uint map = push.first_map + index / (side * side);
    ivec2 at = ivec2(index % side, index / side % side);
    uint texel = atlas_texel(push.fine, map, at);
    if (atlas_texels[texel] != ATLAS_EMPTY) {
        return;
    }
    ivec2 parent = at / 2;
    uint own = atlas_texels[atlas_texel(push.coarse, map, parent)];
    if (own == ATLAS_EMPTY) {
        return;
    }
    // A texel's middle lies a quarter of its parent off the parent's.
    ivec2 beside = 2 * (at & 1) - 1;
    float distance = uintBitsToFloat(own);
    float sum = 0.0;
    float weights = 0.0;
    for (int corner = 0; corner < 4; ++corner) {
        ivec2 offset = ivec2(corner & 1, corner >> 1);
        ShadowTexel other = shadow_wrap(SHADOW_OCTAHEDRON, ShadowTexel(0u, parent + offset * beside), int(push.coarse.side));
        float found = uintBitsToFloat(atlas_texels[atlas_texel(push.coarse, map, other.at)]);
        float weight = (offset.x == 0 ? 0.75 : 0.25) * (offset.y == 0 ? 0.75 : 0.25);
        bool is_same = abs(found - distance) <= ATLAS_SAME_SURFACE * distance;
        sum += is_same ? weight * found : 0.0;
        weights += is_same ? weight : 0.0;
    }
    atlas_texels[texel] = floatBitsToUint(sum / weights);
}
