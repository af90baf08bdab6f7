// Points splatted into an octahedron map, and its levels: nearest distances by their bits, which have the order of positive floats.
// Sources and guarantees: raster/splats.rs.
#ifndef CLERESTORY_RASTER_SPLATS_GLSL
#define CLERESTORY_RASTER_SPLATS_GLSL

// Where nothing is, as a distance and as a number.
const uint SPLAT_NOTHING = 0xFFFFFFFFu;

// Finer texels count with the nearest one when they are farther by no more than this share: others belong to what lies behind.
const float SPLAT_SAME_SURFACE = 0.05;

struct SplatTexel {
    uint distance_bits;  // metres
    uint number;
};

struct SplatLevel {
    uint first;
    uvec2 size;
};

uint splat_texel(SplatLevel level, uvec2 at) { return level.first + at.y * level.size.x + at.x; }

#endif
