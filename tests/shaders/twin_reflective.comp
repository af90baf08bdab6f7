#version 460
// Reflective and imperfect shadow maps, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#include "raster/reflective.glsl"
#include "raster/splat_atlas.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // solid angles
        out1(0u, rsm_solid_angle(in2(0u), in2(2u)));
        break;
    }
    case 1u: {  // steps of points through a pyramid, and radical inverses
        vec2 point = in2(4u);
        ivec2 child = rsm_warp(in4(0u), point);
        out2(0u, point);
        out_bits(2u, uint(2 * child.y + child.x));
        out1(3u, rsm_radical_inverse(in_bits(6u), in_bits(7u)));
        break;
    }
    case 2u: {  // discs
        float distance = length(in3(0u));
        float slack = atlas_slack(in3(15u), distance);
        out1(0u, atlas_distance(in3(0u), in3(3u), in1(6u), slack, in3(7u)));
        out1(1u, atlas_middle_radius(distance, abs(dot(in3(0u), in3(3u))), in1(6u), in1(10u)));
        out1(4u, slack);
        out_bits(2u, atlas_stratum(in_bits(11u), in_bits(12u), in_bits(13u)));
        out_bits(3u, uint(atlas_reach(in1(14u), in1(6u), in1(10u))));
        break;
    }
    }
}
