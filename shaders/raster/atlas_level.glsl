// Square maps of one size, one behind the other in a buffer, and their coarser levels behind them, level by level.
#ifndef CLERESTORY_RASTER_ATLAS_LEVEL_GLSL
#define CLERESTORY_RASTER_ATLAS_LEVEL_GLSL

// The maps of one level.
struct AtlasLevel {
    uint first;  // texel
    uint side;   // texels of a map
};

uint atlas_texel(AtlasLevel level, uint map, ivec2 at) {
    return level.first + (map * level.side + uint(at.y)) * level.side + uint(at.x);
}

#endif
