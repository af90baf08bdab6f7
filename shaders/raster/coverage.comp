#version 460
// Most fragments that blocks of triangles can make in some views, so that draws can be parted by their work. See clerestory::raster::coverage.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster/coverage.glsl"
layout(local_size_x = COVERAGE_BLOCK) in;

#include "invocation.glsl"

layout(set = 1, binding = 0, scalar) restrict writeonly buffer Blocks { float blocks[]; };

layout(push_constant, scalar) uniform Push {
    vec2 size;  // of the target, pixels
    uint triangles;
    uint views;
} push;

shared float sums[COVERAGE_BLOCK];

void main() {
    uint triangle = invocation_index();
    uint lane = gl_LocalInvocationID.x;
    float sum = 0.0;
    for (uint view = 0u; triangle < push.triangles && view < push.views; ++view) {
        sum += coverage_fragments(raster_views[view], push.size, triangle);
    }
    sums[lane] = sum;
    for (uint half_width = COVERAGE_BLOCK / 2u; half_width > 0u; half_width /= 2u) {
        barrier();
        if (lane < half_width) {
            sums[lane] += sums[lane + half_width];
        }
    }
    if (lane == 0u && triangle < push.triangles) {
        blocks[triangle / COVERAGE_BLOCK] = sums[0];
    }
}
