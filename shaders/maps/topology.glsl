// Which texel a border texel repeats, up to one size outside the map. Sources and guarantees: maps/topology.rs.
#ifndef CLERESTORY_MAPS_TOPOLOGY_GLSL
#define CLERESTORY_MAPS_TOPOLOGY_GLSL

#include "maps/cube.glsl"

// The row beyond the upper or lower edge, mirrored into the map.
int mirrored_texel(int p, int size) { return p < 0 ? -1 - p : 2 * size - 1 - p; }

// The square layout of octahedra.
ivec2 octahedron_wrap(ivec2 p, ivec2 size) {
    if (p.x < 0 || p.x >= size.x) {
        p = ivec2(mirrored_texel(p.x, size.x), size.y - 1 - p.y);
    }
    if (p.y < 0 || p.y >= size.y) {
        p = ivec2(size.x - 1 - p.x, mirrored_texel(p.y, size.y));
    }
    return p;
}

// Up to one size outside.
int repeated_texel(int p, int size) { return p < 0 ? p + size : p >= size ? p - size : p; }

ivec2 octahedron_rectangular_wrap(ivec2 p, ivec2 size) {
    p.x = repeated_texel(p.x, size.x);
    return p.y < 0 || p.y >= size.y ? ivec2(size.x - 1 - p.x, mirrored_texel(p.y, size.y)) : p;
}

// Of even width.
ivec2 lat_long_wrap(ivec2 p, ivec2 size) {
    p.x = repeated_texel(p.x, size.x);
    return p.y < 0 || p.y >= size.y ? ivec2(repeated_texel(p.x + size.x / 2, size.x), mirrored_texel(p.y, size.y)) : p;
}

// The cube, whose faces are n x n texels: the face on which a texel lies, which comes to lie inside that. Not beyond corners, where no
// texel repeats.
uint cube_wrap(uint face, inout ivec2 p, int n) {
    // In halves of texels from the middle; what sticks out is folded down the cube's side.
    ivec2 a = 2 * p + 1 - n;
    int deep = max(max(abs(a.x), abs(a.y)) - n, 0);
    uint other;
    vec2 uv = cube_encode(cube_point(face, vec2(clamp(a, -n, n)), float(n - deep)), other);
    // The point is the middle of a texel.
    p = ivec2((0.5 * uv + 0.5) * float(n));
    return other;
}

// Whether the centre of a texel is within the inscribed disc of n x n texels.
bool is_on_disc(ivec2 p, int n) {
    ivec2 a = 2 * p + 1 - n;
    return a.x * a.x + a.y * a.y <= n * n;
}

#endif
