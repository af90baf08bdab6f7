#version 460
// First stage of the tree over virtual lights: Morton codes of their places, by cells as long as wide, and the identity for the sort to permute.
// CL-VPL-CUTS: D. Lin and C. Yuksel, "Real-Time Stochastic Lightcuts", 2020, section 4.1.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "accel/morton.glsl"
#include "techniques/instant_radiosity/light_record.glsl"

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;
layout(set = 0, binding = 1, scalar) restrict writeonly buffer LightKeys { uint light_keys[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer LightOrder { uint light_order[]; };

layout(push_constant, scalar) uniform Push {
    vec3 lower;   // corner of the scene
    float scale;  // cells a metre
    uint lights;
} push;

void main() {
    uint light = gl_GlobalInvocationID.x;
    if (light >= push.lights) {
        return;
    }
    vec3 position = uintBitsToFloat(texelFetch(virtual_light_texels, int(VIRTUAL_LIGHT_QUARTERS * light)).xyz);
    light_keys[light] = morton_30(morton_cell(position, push.lower, vec3(push.scale), MORTON_30_AXIS_BITS));
    light_order[light] = light;
}
