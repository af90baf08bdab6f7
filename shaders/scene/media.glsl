// Participating media of the scene (scene/media_bindings.glsl); twin of clerestory::scene::DensityGrid.
//
// Only kernels that are dispatched for scenes with media use it. Everything is read by texel fetches, as in scene/bindings.glsl.
#ifndef CLERESTORY_SCENE_MEDIA_GLSL
#define CLERESTORY_SCENE_MEDIA_GLSL

#extension GL_EXT_samplerless_texture_functions : require

#include "scene/fetches.glsl"
#include "scene/records.glsl"

#ifndef CLERESTORY_MEDIA_BOUND
#include "scene/media_bindings.glsl"
#endif

uvec4 medium_quarter(uint medium, uint quarter) { return texelFetch(media_records, int(MEDIUM_QUARTERS * medium + quarter)); }

SceneMedium load_medium(uint index) {
    uvec4 q0 = medium_quarter(index, 0u);
    uvec4 q1 = medium_quarter(index, 1u);
    uvec4 q2 = medium_quarter(index, 2u);
    uvec4 q3 = medium_quarter(index, 3u);
    uvec4 q4 = medium_quarter(index, 4u);
    uvec4 q5 = medium_quarter(index, 5u);
    uvec4 q6 = medium_quarter(index, 6u);
    uvec4 q7 = medium_quarter(index, 7u);
    uvec4 q8 = medium_quarter(index, 8u);
    return SceneMedium(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), uintBitsToFloat(q1.w), uintBitsToFloat(q2.xyz),
                       uintBitsToFloat(q2.w), uintBitsToFloat(q3.xyz), q3.w, uintBitsToFloat(q4.xyz), q4.w,
                       uintBitsToFloat(q5.xyz), q5.w, uintBitsToFloat(q6.xyz), uintBitsToFloat(q6.w), q7.xyz, uintBitsToFloat(q7.w), q8.xyz,
                       uintBitsToFloat(q8.w));
}

// A direction of world space in cells of the grid.
vec3 direction_to_cells(SceneMedium m, vec3 d) { return vec3(dot(m.row_x, d), dot(m.row_y, d), dot(m.row_z, d)); }

float fetch_density(SceneMedium m, uvec3 cell) {
    count_fetches(1u, 1u);
    return texelFetch(media_densities, int(m.first_density + (cell.z * m.cells.y + cell.y) * m.cells.x + cell.x)).x;
}

// Density at a point in cells that lies in the grid: between centres by trilinear interpolation, constant outside them.
float density_in_cells(SceneMedium m, vec3 point) {
    vec3 last = vec3(m.cells - 1u);
    vec3 at = clamp(point - 0.5, vec3(0.0), last);
    vec3 below = floor(at);
    vec3 w = at - below;
    uvec3 a = uvec3(below);
    uvec3 b = uvec3(min(below + 1.0, last));
    vec4 x0 = vec4(fetch_density(m, a), fetch_density(m, uvec3(a.x, b.y, a.z)), fetch_density(m, uvec3(a.xy, b.z)),
                   fetch_density(m, uvec3(a.x, b.yz)));
    vec4 x1 = vec4(fetch_density(m, uvec3(b.x, a.yz)), fetch_density(m, uvec3(b.xy, a.z)), fetch_density(m, uvec3(b.x, a.y, b.z)),
                   fetch_density(m, b));
    vec4 x = mix(x0, x1, w.x);
    return mix(mix(x.x, x.y, w.y), mix(x.z, x.w, w.y), w.z);
}

float fetch_majorant(SceneMedium m, ivec3 block) {
    count_fetches(1u, 1u);
    return texelFetch(media_majorants, int(m.first_majorant) + (block.z * int(m.blocks.y) + block.y) * int(m.blocks.x) + block.x).x;
}

#endif
