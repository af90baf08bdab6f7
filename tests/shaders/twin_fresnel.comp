#version 460
// Forms of a metal's Fresnel factor, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

vec4 fresnel_table(uint index) {
    return vec4(twin_table[4u * index], twin_table[4u * index + 1u], twin_table[4u * index + 2u], twin_table[4u * index + 3u]);
}

#include "transport/fresnel_forms.glsl"
#include "transport/fresnel_table.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    float cos_i = in1(0u);
    switch (push.function) {
    case 0u: {  // by n and k
        out3(0u, conductor_f0(in3(1u), in3(4u)));
        out3(3u, fresnel_rescaled(cos_i, in3(1u), in3(4u)));
        out3(6u, fresnel_simplified(cos_i, in3(1u), in3(4u)));
        break;
    }
    case 1u: {  // by coefficients
        out3(0u, fresnel_compensated(cos_i, in3(7u), in3(10u), in3(13u)));
        out3(3u, fresnel_tinted(cos_i, in3(7u), in3(10u)));
        out3(6u, fresnel_schlick_average(in3(7u)));
        out3(9u, fresnel_compensated_average(in3(7u), in3(10u), in3(13u)));
        break;
    }
    case 2u: {  // with the geometric term
        out3(0u, fresnel_table_lookup(cos_i));
        break;
    }
    }
}
