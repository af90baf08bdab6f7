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
    int layers;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer Texels { vec3 texels[]; };

uint target_layer(int i) {
    return uint(min(i / (push.target.size.x * push.target.size.y), push.layers - 1));
}

ivec2 target_texel(int i) {
    return ivec2(i % push.target.size.x, i / push.target.size.x % push.target.size.y);
}

vec3 direction_of(uint layer, ivec2 p, ivec2 size) {
    vec2 uv = (vec2(p) + 0.5) / vec2(size);
    return DIRECTIONAL_KIND == DIRECTIONAL_CUBE ? cube_decode(layer, 2.0 * uv - 1.0) : directional_decode(uv);
}

vec3 target_direction(int i) {
    return direction_of(target_layer(i), target_texel(i), push.target.size);
}

uint place_of(MapLevel level, uint layer, ivec2 p) {
    return DIRECTIONAL_KIND == DIRECTIONAL_CUBE ? directional_texel(level, layer, p) : directional_texel(level, p);
}

void main() {
    int first = int(PREFILTER_TEXELS_PER_INVOCATION * gl_GlobalInvocationID.x);
    int count = push.layers * push.target.size.x * push.target.size.y;
    // Those past the end are made like the others, and not kept.
    mat4x3 r = mat4x3(target_direction(first), target_direction(first + 1), target_direction(first + 2), target_direction(first + 3));
    MapLevel level = map_levels[push.source];
    // Columns are texels: radiance, and what it is divided by.
    mat4 sum = mat4(0.0);
    for (uint layer = 0u; layer < uint(push.layers); ++layer) {
        for (int y = 0; y < level.size.y; ++y) {
            // By rows, so that small terms meet small sums.
            mat4 row = mat4(0.0);
            for (int x = 0; x < level.size.x; ++x) {
                ivec2 p = ivec2(x, y);
                vec3 d = direction_of(layer, p, level.size);
                vec4 light = vec4(map_texels[place_of(level, layer, p)], 1.0) * map_angles[directional_angle(level, p)];
                vec4 lobes = vec4(
                    ggx_lobe(r[0], d, push.alpha), ggx_lobe(r[1], d, push.alpha), ggx_lobe(r[2], d, push.alpha), ggx_lobe(r[3], d, push.alpha)
                );
                row += outerProduct(light, lobes);
            }
            sum += row;
        }
    }
    for (int i = 0; i < int(PREFILTER_TEXELS_PER_INVOCATION); ++i) {
        if (first + i < count) {
            texels[place_of(push.target, target_layer(first + i), target_texel(first + i))] = sum[i].rgb / sum[i].a;
        }
    }
}
