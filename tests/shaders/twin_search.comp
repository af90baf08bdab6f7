#version 460
// Searches in impostors, for comparison with their Rust twins: `function` says which part, the specialization which method. Surfaces are boxes about the map's place.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

// A layer's box has the half width that the table says.
float impostor_look_up(uint layer, vec3 l, float size) {
    return size > 0.0 ? max(abs(l.x), max(abs(l.y), abs(l.z))) / twin_table[layer] : 0.0;
}

#include "maps/impostor.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    vec3 x = in3(0u);
    vec3 r = in3(3u);
    vec2 extent = in2(6u);
    float tolerance = in1(8u);
    uint layer = in_bits(10u);
    switch (push.function) {
    case 0u: {
        out1(0u, impostor_ratio(layer, x, r, in1(9u)));
        break;
    }
    case 1u: {
        out1(0u, impostor_by_steps(layer, x, r, extent.y));
        break;
    }
    case 2u: {
        out1(0u, impostor_by_march(layer, x, r, extent, tolerance));
        break;
    }
    case 3u: {
        ImpostorHit hit = impostor_search(x, r, extent, tolerance);
        out3(0u, hit.direction);
        out1(3u, hit.distance);
        out1(4u, hit.residual);
        out_bits(5u, hit.layer);
        break;
    }
    }
}
