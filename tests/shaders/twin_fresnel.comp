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
#include "transport/microfacets.glsl"

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
    case 3u: {  // microfacets: l, v, slope, exponent, numbers
        vec3 l = in3(0u);
        vec3 v = in3(3u);
        vec3 h = normalize(l + v);
        out1(0u, beckmann_d(h, in1(6u)));
        out1(1u, cosine_lobe_d(h, in1(7u)));
        out1(2u, cook_torrance_g(l, v, h));
        out1(3u, kelemen_g(l, h));
        out1(4u, beckmann_g1(l, in1(6u)));
        out1(5u, cosine_lobe_g1(l, in1(7u)));
        out1(6u, smith_g(l, v, beckmann_g1(l, in1(6u)), beckmann_g1(v, in1(6u))));
        out3(7u, beckmann_sample(in1(6u), in2(8u)));
        out3(10u, cosine_lobe_sample(in1(7u), in2(8u)));
        break;
    }
    case 4u: {  // by reflectance and edge tint
        vec3 eta;
        vec3 k;
        artistic_index(in3(0u), in3(3u), eta, k);
        out3(0u, eta);
        out3(3u, k);
        break;
    }
    case 2u: {  // with the geometric term
        out3(0u, fresnel_table_lookup(0u, cos_i));
        out3(3u, fresnel_tabulated(0u, cos_i));
        // The same table again, behind the first.
        out3(6u, fresnel_tabulated(1u, cos_i));
        break;
    }
    }
}
