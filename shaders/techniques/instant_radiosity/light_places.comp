#version 460
// Where virtual lights are, just off their surfaces, for maps that are drawn about them.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/virtual_light.glsl"

layout(push_constant, scalar) uniform Push {
    uint lights;
} push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;
layout(set = 0, binding = 1, scalar) restrict writeonly buffer MapOrigins { vec4 map_origins[]; };

void main() {
    uint number = invocation_index();
    if (number >= push.lights) {
        return;
    }
    int first = int(VIRTUAL_LIGHT_QUARTERS * number);
    // The place of a light is in its first two quarters.
    VirtualLight light = unpack_virtual_light(texelFetch(virtual_light_texels, first), texelFetch(virtual_light_texels, first + 1), uvec4(0u), uvec4(0u));
    map_origins[number] = vec4(light.position + light.offset * light.normal, 0.0);
}
