#version 460
// Radiance to the screen: the mean of a pixel's samples, exposed, clipped and sRGB-encoded, as four bytes per pixel.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "srgb.glsl"

layout(push_constant, scalar) uniform Push {
    uint width;    // of the shown picture
    uint height;
    uint samples;  // along each side of a pixel
    float scale;   // 2 to the power of the exposure
    uint bgra;     // 1: blue first
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Radiance { vec3 radiance[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer DisplayPixels { uint display_pixels[]; };

void main() {
    uint i = invocation_index();
    if (i >= push.width * push.height) {
        return;
    }
    uvec2 first = push.samples * uvec2(i % push.width, i / push.width);
    vec3 sum = vec3(0.0);
    for (uint y = 0u; y < push.samples; ++y) {
        for (uint x = 0u; x < push.samples; ++x) {
            // Each sample as the screen could show it, so that edges of lamps are smooth, too.
            sum += clamp(push.scale * radiance[(first.y + y) * push.width * push.samples + first.x + x], 0.0, 1.0);
        }
    }
    vec3 srgb = srgb_from_linear(sum / float(push.samples * push.samples));
    display_pixels[i] = packUnorm4x8(vec4(push.bgra != 0u ? srgb.bgr : srgb, 1.0));
}
