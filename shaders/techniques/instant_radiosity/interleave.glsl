// Interleaved sampling: a picture's pixels go to n x n tiles, so that pixels of one tile are next to each other and share a subset of the lights, and
// neighbours in the picture have different ones. Twin of many_light/interleave.rs.
//
// SVO-P7, SVO-P13: A. Keller and W. Heidrich, "Interleaved Sampling", 2001; B. Segovia et al., "Non-interleaved Deferred Shading of Interleaved Sample Patterns", 2006.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_INTERLEAVE_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_INTERLEAVE_GLSL

// Places of a tile are filled up to whole workgroups, so that a workgroup has one subset of the lights.
const uint INTERLEAVE_GROUP = 64u;

// Pixels across and down of a tile, of the largest ones where n divides no side.
uvec2 interleave_tile(uvec2 size, uint n) { return (size + n - 1u) / n; }

// Places of a tile.
uint interleave_stride(uvec2 size, uint n) {
    uvec2 tile = interleave_tile(size, n);
    return (tile.x * tile.y + INTERLEAVE_GROUP - 1u) / INTERLEAVE_GROUP * INTERLEAVE_GROUP;
}

// The place of a pixel.
uint interleave_split(uvec2 pixel, uvec2 size, uint n) {
    uvec2 of_tile = pixel % n;
    uvec2 within = pixel / n;
    return (of_tile.y * n + of_tile.x) * interleave_stride(size, n) + within.y * interleave_tile(size, n).x + within.x;
}

// The pixel of a place; false where it fills up a tile.
bool interleave_merge(uint place, uvec2 size, uint n, out uvec2 pixel) {
    uvec2 tile = interleave_tile(size, n);
    uint stride = interleave_stride(size, n);
    uint of = place / stride;
    uint within = place % stride;
    pixel = uvec2(within % tile.x, within / tile.x) * n + uvec2(of % n, of / n);
    return within / tile.x < tile.y && pixel.x < size.x && pixel.y < size.y;
}

// The subset of a tile, where the first tile has the subset `first`.
uint interleave_subset_of_tile(uint tile, uint first, uint subsets) { return (tile % subsets + first) % subsets; }

// The lights of a subset: consecutive ones, at least one where there are any, and all of them in all subsets where they are no fewer.
uvec2 interleave_lights(uint subset, uint subsets, uint lights) {
    uint first = subset * lights / subsets;
    return uvec2(first, min(max((subset + 1u) * lights / subsets, first + 1u), lights));
}

// The last subset that has a light.
uint interleave_subset(uint light, uint subsets, uint lights) { return ((light + 1u) * subsets - 1u) / lights; }

#endif
