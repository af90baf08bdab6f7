#version 460
// First half of a summed-area table: sums along the rows of a bordered map, an invocation per row.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/directional_map_set.glsl"
#include "maps/sat_value.glsl"

layout(push_constant, scalar) uniform Push {
    vec4 scale;       // of each channel's integers
    vec3 offset;      // taken from radiance
    float per_angle;  // weight of a steradian
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Sums { SatValue sums[]; };

void main() {
    MapLevel level = map_levels[0];
    ivec2 tile = level.size + 2 * DIRECTIONAL_BORDER;
    int y = int(gl_GlobalInvocationID.x);
    if (y > tile.y) {
        return;
    }
    SatValue sum;
    for (uint c = 0u; c < SAT_CHANNELS; ++c) {
        sum.channel[c] = uvec2(0u);
    }
    uint at = uint(y * (tile.x + 1));
    sums[at] = sum;
    for (int x = 0; x < tile.x; ++x) {
        if (y > 0) {
            ivec2 p = ivec2(x, y - 1) - DIRECTIONAL_BORDER;
            ivec2 inside = directional_wrap(p, level.size);
            float weight = push.per_angle * map_angles[directional_angle(level, inside)];
            vec4 value = vec4(weight * (map_texels[directional_texel(level, p)] - push.offset), weight);
            for (uint c = 0u; c < SAT_CHANNELS; ++c) {
                sum.channel[c] = sat_added(sum.channel[c], sat_number(value[c], push.scale[c]));
            }
        }
        sums[at + uint(x) + 1u] = sum;
    }
}
