#version 460
// Shader functions that read tables, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

const bool SEPARABLE_MASKING = false;

float distribution_cdf(uint index) { return twin_table[index]; }
float albedo_table(uint index) { return twin_table[index]; }

#include "transport/albedo.glsl"
#include "transport/environment.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // albedos
        float weight;
        uint layer = albedo_layer(in1(3u), weight);
        out1(0u, albedo_lookup(in_bits(0u), in1(1u), in1(2u)));
        out1(1u, albedo_average(in_bits(0u), in1(2u)));
        out1(2u, float(layer) + weight);
        break;
    }
    case 1u: {  // choice among entries
        float probability;
        out_bits(0u, distribution_sample(0u, in_bits(0u), in1(1u), probability));
        out1(1u, probability);
        break;
    }
    case 2u: {  // environment maps
        uvec2 size = uvec2(in_bits(0u), in_bits(1u));
        uvec2 texel;
        out3(0u, environment_sample(0u, size, in2(2u), in2(4u), texel));
        out_bits(4u, texel.x);
        out_bits(5u, texel.y);
        out2(6u, environment_uv(in3(6u)));
        out3(9u, environment_direction(in2(4u)));
        break;
    }
    }
}
