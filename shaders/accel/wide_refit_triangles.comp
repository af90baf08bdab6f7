// First stage of refitting a wide hierarchy: triangles that have moved, into the places that the tree gave them.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/wide_layout.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict buffer WideTexels { uvec4 wide_texels[]; };
// By the triangles' indices, three words each; of those that are not in the tree nothing is read.
layout(set = 0, binding = 1, scalar) restrict readonly buffer WideCorners { uint wide_corners[]; };

layout(push_constant, scalar) uniform WideRefitTrianglesPush { uint count; } wide_push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= wide_push.count) {
        return;
    }
    uint texel = wide_texels[0].w + WIDE_TRIANGLE_TEXELS * place;
    uvec4 last = wide_texels[texel + 2u];
    uint at = 9u * last.y;
    wide_texels[texel] = uvec4(wide_corners[at], wide_corners[at + 1u], wide_corners[at + 2u], wide_corners[at + 3u]);
    wide_texels[texel + 1u] = uvec4(wide_corners[at + 4u], wide_corners[at + 5u], wide_corners[at + 6u], wide_corners[at + 7u]);
    wide_texels[texel + 2u] = uvec4(wide_corners[at + 8u], last.yzw);
}
