// Means over boxes of a map by its summed-area table: set 2, filled by clerestory::maps::spherical_sat::SphericalSat.
#ifndef CLERESTORY_MAPS_SPHERICAL_SAT_GLSL
#define CLERESTORY_MAPS_SPHERICAL_SAT_GLSL

#include "maps/sat_value.glsl"

struct SatShape {
    ivec2 size;   // texels of the map
    int border;   // texels about it
    vec4 scale;   // of each channel's integers
    vec3 offset;  // what was taken from radiance before it was summed
};

// descriptor set 2: SphericalSatSet

layout(set = 2, binding = 0, scalar) restrict readonly buffer SatShapes { SatShape sat_shape; };
// Rows of one more than the bordered map, the first of zeros.
layout(set = 2, binding = 1, scalar) restrict readonly buffer SatSums { SatValue sat_sums[]; };

// The sums of a box between lines of texels.
vec4 sat_box(uint left, uint right, uint upper, uint lower) {
    vec4 sums;
    for (uint c = 0u; c < SAT_CHANNELS; ++c) {
        uvec2 below = sat_subtracted(sat_sums[lower + right].channel[c], sat_sums[lower + left].channel[c]);
        uvec2 above = sat_subtracted(sat_sums[upper + right].channel[c], sat_sums[upper + left].channel[c]);
        sums[c] = sat_float(sat_subtracted(below, above), sat_shape.scale[c]);
    }
    return sums;
}

// The mean over a square of coordinates [0, 1]^2 about a place, of texels that are constant each; it goes on over edges, and ends where the border does.
vec3 sat_mean(vec2 uv, float half_width) {
    vec2 tile = vec2(sat_shape.size + 2 * sat_shape.border);
    vec2 middle = uv * vec2(sat_shape.size) + float(sat_shape.border);
    // A map of two squares is twice as wide as high: its texels are square.
    float reach = half_width * float(sat_shape.size.y);
    vec2 low = clamp(middle - reach, vec2(0.0), tile);
    vec2 high = clamp(middle + reach, vec2(0.0), tile);
    ivec2 last = ivec2(tile);
    ivec2 a = ivec2(low);
    ivec2 b = ivec2(high);
    // Lines between which texels count fully or in part: cut texels, those between, cut texels.
    ivec4 columns = min(ivec4(a.x, a.x + 1, b.x, b.x + 1), last.x);
    ivec4 rows = min(ivec4(a.y, a.y + 1, b.y, b.y + 1), last.y) * (last.x + 1);
    vec3 across = vec3(1.0 - (low.x - float(a.x)), 1.0, high.x - float(b.x));
    vec3 down = vec3(1.0 - (low.y - float(a.y)), 1.0, high.y - float(b.y));
    vec4 sums = vec4(0.0);
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x) {
            vec4 box = sat_box(uint(columns[x]), uint(columns[x + 1]), uint(rows[y]), uint(rows[y + 1]));
            sums += across[x] * down[y] * box;
        }
    }
    return sums.rgb / sums.a + sat_shape.offset;
}

#endif
