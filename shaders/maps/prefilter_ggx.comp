#version 460
// A map filtered by the GGX lobe about each direction: the sum over all texels of a level. Sources and guarantees: maps/prefilter.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/directional_map_set.glsl"
#include "maps/ggx_lobe.glsl"

layout(push_constant, scalar) uniform Push {
    MapLevel target;
    uint source;  // level
    float alpha;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Texels { vec3 texels[]; };

ivec2 target_texel(int i) {
    return ivec2(i % push.target.size.x, i / push.target.size.x);
}

vec3 target_direction(int i) {
    return directional_decode((vec2(target_texel(i)) + 0.5) / vec2(push.target.size));
}

void main() {
    int first = int(PREFILTER_TEXELS_PER_INVOCATION * gl_GlobalInvocationID.x);
    int count = push.target.size.x * push.target.size.y;
    // Those past the end are made like the others, and not kept.
    mat4x3 r = mat4x3(target_direction(first), target_direction(first + 1), target_direction(first + 2), target_direction(first + 3));
    MapLevel level = map_levels[push.source];
    // Columns are texels: radiance, and what it is divided by.
    mat4 sum = mat4(0.0);
    for (int y = 0; y < level.size.y; ++y) {
        // By rows, so that small terms meet small sums.
        mat4 row = mat4(0.0);
        for (int x = 0; x < level.size.x; ++x) {
            vec3 d = directional_decode((vec2(x, y) + 0.5) / vec2(level.size));
            vec4 light = vec4(map_texels[directional_texel(level, ivec2(x, y))], 1.0) * map_angles[directional_angle(level, ivec2(x, y))];
            vec4 lobes = vec4(
                ggx_lobe(r[0], d, push.alpha), ggx_lobe(r[1], d, push.alpha), ggx_lobe(r[2], d, push.alpha), ggx_lobe(r[3], d, push.alpha)
            );
            row += outerProduct(light, lobes);
        }
        sum += row;
    }
    for (int i = 0; i < int(PREFILTER_TEXELS_PER_INVOCATION); ++i) {
        if (first + i < count) {
            texels[directional_texel(push.target, target_texel(first + i))] = sum[i].rgb / sum[i].a;
        }
    }
}
