// Which texel a border texel repeats, up to one size outside of the map. Sources and guarantees: maps/topology.rs.
#ifndef CLERESTORY_MAPS_TOPOLOGY_GLSL
#define CLERESTORY_MAPS_TOPOLOGY_GLSL

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

#endif
