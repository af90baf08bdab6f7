#version 460
// Records of the virtual lights that chains have kept: those of the pool, with the power that a weight each leaves them.
//
// SVO-G5: B. Segovia et al., "Metropolis Instant Radiosity", 2007. Deterministic.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "techniques/instant_radiosity/light_record.glsl"

layout(push_constant, scalar) uniform Push { uint lights; } push;

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;  // the pool
layout(set = 0, binding = 1, scalar) restrict readonly buffer MetropolisChosen { uint metropolis_chosen[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer MetropolisWeights { float metropolis_weights[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer VirtualLightRecords { uvec4 virtual_light_records[]; };

void main() {
    uint number = invocation_index();
    if (number >= push.lights) {
        return;
    }
    int first = int(VIRTUAL_LIGHT_QUARTERS * metropolis_chosen[number]);
    for (uint i = 0u; i < VIRTUAL_LIGHT_QUARTERS; ++i) {
        uvec4 quarter = texelFetch(virtual_light_texels, first + int(i));
        if (i == LIGHT_POWER_QUARTER) {
            quarter.xyz = floatBitsToUint(metropolis_weights[number] * uintBitsToFloat(quarter.xyz));
        }
        virtual_light_records[VIRTUAL_LIGHT_QUARTERS * number + i] = quarter;
    }
}
