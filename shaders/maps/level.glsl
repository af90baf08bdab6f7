// Levels of detail of look-ups in octahedron maps, not clamped. Sources and guarantees: maps/level.rs.
#ifndef CLERESTORY_MAPS_LEVEL_GLSL
#define CLERESTORY_MAPS_LEVEL_GLSL

#include "maps/octahedron.glsl"

// Of two derivatives in texels.
float level_of_derivatives(vec2 across, vec2 down) { return 0.5 * log2(max(dot(across, across), dot(down, down))); }

// The signs of the direction's own octant, and by how much z is folded out: nothing for z >= 0.
void octahedron_octant(vec3 d, out vec3 s, out vec2 fold) {
    s = vec3(octahedron_signs(d.xy), d.z < 0.0 ? -1.0 : 1.0);
    fold = d.z < 0.0 ? s.xy : vec2(0.0);
}

// n x n texels; dx and dy are derivatives of the direction by the pixel's coordinates.
float octahedron_level(vec3 d, vec3 dx, vec3 dy, float n) {
    vec3 s;
    vec2 fold;
    octahedron_octant(d, s, fold);
    float w = dot(d, s);
    vec2 uv = (d.xy - fold * d.z) / w;
    float scale = 0.5 * n / w;
    return level_of_derivatives(scale * (dx.xy - fold * dx.z - uv * dot(dx, s)), scale * (dy.xy - fold * dy.z - uv * dot(dy, s)));
}

// 2n x n texels.
float octahedron_rectangular_level(vec3 d, vec3 dx, vec3 dy, float n) {
    vec3 s;
    vec2 fold;
    octahedron_octant(d, s, fold);
    float w = dot(d, s);
    vec2 p = d.xy / w;
    float scale = 0.5 * n / w;
    vec2 x = scale * (dx.xy - p * dot(dx, s));
    vec2 y = scale * (dy.xy - p * dot(dy, s));
    return level_of_derivatives(vec2(x.x - x.y, x.x + x.y), vec2(y.x - y.y, y.x + y.y));
}

// n x n texels, from the directions of a pixel, its neighbour across and its neighbour below: for where derivatives are not at hand.
float octahedron_level_folded(vec3 d, vec3 across, vec3 down, float n) {
    vec2 here = octahedron_encode(d);
    float plain = level_of_derivatives(0.5 * n * (octahedron_encode(across) - here), 0.5 * n * (octahedron_encode(down) - here));
    // Only where the whole quad is below: mirrored, one on the equator would look finer than it is.
    if (max(d.z, max(across.z, down.z)) >= 0.0) {
        return plain;
    }
    const vec3 mirror = vec3(1.0, 1.0, -1.0);
    here = octahedron_encode(d * mirror);
    float folded = level_of_derivatives(
        0.5 * n * (octahedron_encode(across * mirror) - here),
        0.5 * n * (octahedron_encode(down * mirror) - here));
    return min(plain, folded);
}

// The level at which a texel is as large as a cone, from both solid angles.
float level_of_cone(float cone, float texel) { return 0.5 * log2(cone / texel); }

#endif
