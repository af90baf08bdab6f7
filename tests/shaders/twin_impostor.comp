#version 460
// Functions of impostors and of gathers, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

vec3 map_place(uint i) { return vec3(twin_table[3u * i], twin_table[3u * i + 1u], twin_table[3u * i + 2u]); }

float gather_table_value(uint i) { return twin_table[i]; }

#include "maps/gather_disc.glsl"
#include "maps/impostor_step.glsl"
#include "maps/map_places.glsl"
#include "maps/proxy.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // proxies
        vec3 x = in3(0u);
        vec3 r = in3(3u);
        out1(0u, sphere_proxy(x, r, in1(6u)));
        out1(1u, hemisphere_proxy(x, r, in1(6u)));
        out1(2u, box_proxy(x, r, in3(7u), in3(10u)));
        break;
    }
    case 1u: {  // directions
        out3(0u, mirrored(in3(0u), in3(3u)));
        out3(3u, refracted(in3(0u), in3(3u), in1(6u)));
        break;
    }
    case 2u: {  // steps
        out1(0u, impostor_step(in2(0u), in_bits(5u) != 0u, in2(2u), in1(4u)));
        break;
    }
    case 5u: {  // planes of texels
        vec4 plane = impostor_plane(in1(0u), in3(1u), in3(4u));
        out3(0u, plane.xyz);
        out1(3u, plane.w);
        out1(4u, impostor_plane_ratio(plane, in3(7u), in1(10u)));
        break;
    }
    case 3u: {  // places of maps
        float weight;
        uvec2 maps = blended_maps(in_bits(3u), in3(0u), weight);
        out_bits(0u, maps.x);
        out_bits(1u, maps.y);
        out1(2u, weight);
        break;
    }
    case 4u: {  // discs and reflectivities
        out1(0u, gather_disc(in1(0u)));
        out1(1u, gather_disc(in1(1u) / in1(2u)));
        out1(2u, gather_reflectivity(in1(3u), in1(4u)));
        break;
    }
    }
}
