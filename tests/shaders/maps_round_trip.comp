#version 460
// Directions to places on a map and back.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/cube.glsl"
#include "maps/equal_area.glsl"
#include "maps/lat_long.glsl"
#include "maps/nusselt.glsl"
#include "maps/octahedron.glsl"
#include "maps/paraboloid.glsl"
#include "maps/sphere_map.glsl"

// Three numbers a direction.
layout(set = 0, binding = 0, scalar) restrict readonly buffer MapDirections { float map_directions[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer MapDecoded { float map_decoded[]; };

layout(push_constant, scalar) uniform Push {
    uint map;
    uint direction_count;
} push;

void main() {
    uint i = 3u * gl_GlobalInvocationID.x;
    if (gl_GlobalInvocationID.x >= push.direction_count) {
        return;
    }
    vec3 d = vec3(map_directions[i], map_directions[i + 1u], map_directions[i + 2u]);
    uint layer;
    vec2 uv;
    switch (push.map) {
    case 0u:
        d = lat_long_decode(lat_long_encode(d));
        break;
    case 1u:
        d = sphere_map_decode(sphere_map_encode(d));
        break;
    case 2u:
        uv = cube_encode(d, layer);
        d = cube_decode(layer, uv);
        break;
    case 3u:
        uv = paraboloid_encode(d, layer);
        d = paraboloid_decode(layer, uv);
        break;
    case 4u:
        d = nusselt_decode(nusselt_encode(d));
        break;
    case 5u:
        d = octahedron_decode(octahedron_encode(d));
        break;
    case 6u:
        d = octahedron_rectangular_decode(octahedron_rectangular_encode(d));
        break;
    case 7u:
        d = octahedron_perspective_decode(octahedron_perspective_encode(d, 0.5), 0.5);
        break;
    case 8u:
        d = equal_area_decode(equal_area_encode(d));
        break;
    }
    map_decoded[i] = d.x;
    map_decoded[i + 1u] = d.y;
    map_decoded[i + 2u] = d.z;
}
