#version 460
// A coarser level: the mean distance of the nearest of four texels and those of its surface, with the nearest one's number.
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
    if (index >= push.coarse.size.x * push.coarse.size.y) {
        return;
    }
    uvec2 at = uvec2(index % push.coarse.size.x, index / push.coarse.size.x);
    SplatTexel nearest = SplatTexel(SPLAT_NOTHING, SPLAT_NOTHING);
    uint found[4];
    for (uint child = 0u; child < 4u; ++child) {
        uvec2 place = 2u * at + uvec2(child & 1u, child >> 1u);
        found[child] = SPLAT_NOTHING;
        if (all(lessThan(place, push.fine.size))) {
            SplatTexel texel = texels[splat_texel(push.fine, place)];
            found[child] = texel.distance_bits;
            if (texel.distance_bits < nearest.distance_bits) {
                nearest = texel;
            }
        }
    }
    if (nearest.distance_bits != SPLAT_NOTHING) {
        float farthest = (1.0 + SPLAT_SAME_SURFACE) * uintBitsToFloat(nearest.distance_bits);
        float sum = 0.0;
        float count = 0.0;
        for (uint child = 0u; child < 4u; ++child) {
            float distance = uintBitsToFloat(found[child]);
            if (found[child] != SPLAT_NOTHING && distance <= farthest) {
                sum += distance;
                count += 1.0;
            }
        }
        nearest.distance_bits = floatBitsToUint(sum / count);
    }
    texels[splat_texel(push.coarse, at)] = nearest;
}
