#version 460
// The surface scattering function with every feature, for comparison with its Rust twin.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

const bool HAS_METAL = true;
const bool HAS_EXACT_CONDUCTOR = true;
const bool HAS_SCHLICK_CONDUCTOR = true;
const bool HAS_COMPENSATED_CONDUCTOR = true;
const bool HAS_TINTED_CONDUCTOR = true;
const bool HAS_SIMPLIFIED_CONDUCTOR = true;
const bool HAS_TABLE_CONDUCTOR = true;
const bool HAS_CLASSIC_MICROFACETS = true;
const bool HAS_PHONG = true;
const bool HAS_SPECULAR_LAYER = true;
const bool HAS_TRANSMISSION = true;
const bool HAS_MULTIPLE_SCATTERING = true;
const bool SEPARABLE_MASKING = false;

float albedo_table(uint index) { return twin_table[index]; }

#include "transport/albedo.glsl"

// Nodes stand behind the albedos.
vec4 fresnel_table(uint index) {
    uint first = AVERAGE_BASE + (ETA_NODES + 2u) * ALPHA_NODES + 4u * index;
    return vec4(twin_table[first], twin_table[first + 1u], twin_table[first + 2u], twin_table[first + 3u]);
}

#include "transport/bsdf.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    Bsdf b = bsdf_gltf(in3(0u), in1(3u), in1(4u), in1(5u), in1(6u), in1(7u), in3(8u), in1(11u));
    b.conductor_a = in3(12u);
    b.conductor_b = in3(15u);
    b.conductor_c = in3(18u);
    b.flags |= in_bits(21u);
    vec3 wo = in3(22u);
    uint mask = in_bits(31u);
    if (push.function == 0u) {
        vec4 f = bsdf_eval_pdf(b, wo, in3(25u), mask);
        out3(0u, f.rgb);
        out1(3u, f.a);
    } else {
        BsdfSample s = bsdf_sample(b, wo, in3(28u), mask);
        out3(0u, s.wi);
        out1(3u, s.pdf);
        out3(4u, s.weight);
        out_bits(7u, s.flags);
        out1(8u, s.choice);
    }
}
