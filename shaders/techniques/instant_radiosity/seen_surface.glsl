// Which pixels of a G-buffer see the same surface. Expects, declared before the inclusion, its pictures `seen_positions`, whose w is 0 where there is nothing, and
// `seen_normals`.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_SURFACE_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_SURFACE_GLSL

#include "raster/same_surface.glsl"
#include "raster/seen_normals.glsl"

vec3 seen_normal(ivec2 pixel) { return shading_normal(texelFetch(seen_normals, pixel, 0).xy); }

// Whether another pixel lies in the tangent plane of a point, up to a distance, and has its normal, up to a cosine.
bool is_same_surface(vec3 position, vec3 normal, ivec2 other, float plane_max, float normal_min) {
    vec4 there = texelFetch(seen_positions, other, 0);
    bool is_near = there.w != 0.0 && lies_in_plane(position, normal, there.xyz, plane_max);
    return is_near && is_same_normal(normal, seen_normal(other), normal_min);
}

#endif
