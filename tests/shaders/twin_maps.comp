#version 460
// Maps of directions, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#include "maps/cube.glsl"
#include "maps/equal_area.glsl"
#include "maps/lat_long.glsl"
#include "maps/level.glsl"
#include "maps/nusselt.glsl"
#include "maps/octahedron.glsl"
#include "maps/packed_direction.glsl"
#include "maps/paraboloid.glsl"
#include "maps/sphere_map.glsl"
#include "maps/topology.glsl"

void out_texel(uint i, ivec2 p) {
    out1(i, float(p.x));
    out1(i + 1u, float(p.y));
}

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    vec3 d = in3(0u);
    vec2 uv = in2(3u);
    switch (push.function) {
    case 0u: {  // octahedra
        vec2 wide = uv * vec2(2.0, 1.0);
        out2(0u, octahedron_perspective_encode(d, in1(5u)));
        out3(2u, octahedron_perspective_decode(uv, in1(5u)));
        out1(5u, octahedron_perspective_density(uv, in1(5u)));
        out2(6u, octahedron_rectangular_encode(d));
        out3(8u, octahedron_rectangular_decode(wide));
        out1(11u, octahedron_rectangular_density(wide));
        break;
    }
    case 1u: {  // faces and discs without trigonometry
        uint layer;
        out2(0u, cube_encode(d, layer));
        out1(2u, float(layer));
        out3(3u, cube_decode(in_bits(5u), uv));
        out1(6u, cube_density(uv));
        out2(7u, paraboloid_encode(d, layer));
        out1(9u, float(layer));
        out3(10u, paraboloid_decode(in_bits(5u) & 1u, uv));
        out1(13u, paraboloid_density(uv));
        break;
    }
    case 2u: {  // discs with roots
        out2(0u, sphere_map_encode(d));
        out3(2u, sphere_map_decode(uv));
        out1(5u, sphere_map_density(uv));
        out2(6u, nusselt_encode(d));
        out3(8u, nusselt_decode(uv));
        out1(11u, nusselt_density(0.5 * uv));
        break;
    }
    case 3u: {  // with trigonometry
        vec2 unit = 0.5 + 0.5 * uv;
        out2(0u, lat_long_encode(d));
        out3(2u, lat_long_decode(unit));
        out1(5u, lat_long_density(unit));
        out2(6u, equal_area_encode(d));
        out3(8u, equal_area_decode(uv));
        out1(11u, equal_area_density(uv));
        break;
    }
    case 4u: {  // levels
        out1(0u, octahedron_level(d, in3(3u), in3(6u), in1(15u)));
        out1(1u, octahedron_rectangular_level(d, in3(3u), in3(6u), in1(15u)));
        out1(2u, octahedron_level_folded(d, in3(9u), in3(12u), in1(15u)));
        out1(3u, level_of_cone(in1(16u), in1(17u)));
        break;
    }
    case 5u: {  // borders
        ivec2 p = ivec2(in2(0u));
        ivec2 size = ivec2(in2(2u));
        out_texel(0u, octahedron_wrap(p, size.yy));
        out_texel(2u, octahedron_rectangular_wrap(p, size));
        out_texel(4u, lat_long_wrap(p, size));
        break;
    }
    case 7u: {  // borders of the cube
        ivec2 p = ivec2(in2(0u));
        out1(0u, float(cube_wrap(in_bits(2u), p, int(in1(3u)))));
        out_texel(1u, p);
        break;
    }
    case 6u: {  // words
        uint word = pack_octahedral(d, in_bits(3u));
        out_bits(0u, word & 0xFFFFu);
        out_bits(1u, word >> 16u);
        out3(2u, unpack_octahedral(in_bits(4u), in_bits(3u)));
        break;
    }
    }
}
