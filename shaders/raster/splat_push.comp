#version 460
// Texels of a level at which there is nothing: what the coarser level has there.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "raster/splats.glsl"

layout(push_constant, scalar) uniform Push {
    SplatLevel fine;
    SplatLevel coarse;
} push;

layout(set = 0, binding = 0, scalar) restrict buffer Texels { SplatTexel texels[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.fine.size.x * push.fine.size.y) {
        return;
    }
    uvec2 at = uvec2(index % push.fine.size.x, index / push.fine.size.x);
    uint texel = splat_texel(push.fine, at);
    if (texels[texel].distance_bits == SPLAT_NOTHING) {
        texels[texel] = texels[splat_texel(push.coarse, at / 2u)];
    }
}
