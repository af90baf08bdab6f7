#version 460
// Omnidirectional shadow maps and light probes, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#include "raster/omni_shadow.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    uint kind = in_bits(0u);
    int side = int(in_bits(1u));
    vec3 d = in3(2u);
    switch (push.function) {
    case 0u: {  // texels
        out1(0u, shadow_texel_radius(kind, d, side));
        break;
    }
    case 1u: {  // receivers and thresholds
        ShadowReceiver r = shadow_receiver(kind, side, int(in_bits(5u)), in3(6u), in3(9u), in3(12u), in1(15u));
        out3(0u, r.to);
        out1(3u, r.distance);
        out1(4u, r.height);
        out1(5u, shadow_threshold(r, d));
        break;
    }
    }
}
