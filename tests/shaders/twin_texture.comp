#version 460
// Texture look-ups in the buffers of a scene, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"
#define CLERESTORY_FLAT_SCENE
#include "scene/texture.glsl"

void out4(uint i, vec4 x) {
    out3(i, x.rgb);
    out1(i + 3u, x.a);
}

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u:
        out4(0u, sample_texture(in_bits(0u), in4(1u)));
        break;
    case 1u:
        out4(0u, fetch_texel(load_texture(in_bits(0u)), ivec2(int(in_bits(1u)), int(in_bits(2u)))));
        break;
    case 2u:
        out_bits(0u, wrap_texel(int(in_bits(0u)), in_bits(1u), in_bits(2u)));
        out3(1u, linear_from_srgb(in3(3u)));
        break;
    }
}
