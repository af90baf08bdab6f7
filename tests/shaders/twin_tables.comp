#version 460
// Shader functions that read tables, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

const bool SEPARABLE_MASKING = false;

#define CLERESTORY_SAMPLER 1u

float distribution_cdf(uint index) { return twin_table[index]; }
vec4 environment_texel(uint index) {
    return vec4(twin_table[4u * index], twin_table[4u * index + 1u], twin_table[4u * index + 2u], twin_table[4u * index + 3u]);
}
float albedo_table(uint index) { return twin_table[index]; }

// A word travels as two halves: its bits must not pass through floating-point registers that could quieten a NaN.
uint in_word(uint i) { return uint(in1(i)) << 16u | uint(in1(i + 1u)); }

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
        uint word = in_word(1u);
        out_bits(0u, distribution_sample(0u, in_bits(0u), word, in_word(3u), probability));
        out1(1u, probability);
        out1(2u, unit_float(word));
        break;
    }
    case 2u: {  // environment maps, whose texels stand first
        uvec2 size = uvec2(in_bits(0u), in_bits(1u));
        uint base = 4u * size.x * (size.y + 1u);
        vec4 found;
        bool emission = in_bits(16u) != 0u;
        out3(0u, environment_sample(base, size, in1(15u), emission, uvec2(in_word(2u), in_word(4u)), uvec2(in_word(6u), in_word(8u)), found));
        out3(3u, found.rgb);
        out1(6u, found.a);
        vec4 seen = environment_look_up(size, in1(15u), in3(10u));
        out3(7u, seen.rgb);
        out1(10u, seen.a);
        out2(11u, environment_uv(in3(10u)));
        out3(13u, environment_direction(in2(13u)));
        break;
    }
    case 4u: {  // densities of the emission of environment maps
        uvec2 size = uvec2(in_bits(0u), in_bits(1u));
        out1(0u, environment_emission_pdf(4u * size.x * (size.y + 1u), size, in3(10u)));
        break;
    }
    case 3u: {  // numbers that are used again, linear densities
        float u = in1(0u);
        out1(0u, choose_first(u, in1(1u)) ? 1.0 : 0.0);
        out1(1u, u);
        out1(2u, linear_sample(in1(0u), in1(2u), in1(3u)));
        break;
    }
    }
}
