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

void main() {
    int i = int(gl_GlobalInvocationID.x);
    if (i >= push.target.size.x * push.target.size.y) {
        return;
    }
    ivec2 p = ivec2(i % push.target.size.x, i / push.target.size.x);
    vec3 r = directional_decode((vec2(p) + 0.5) / vec2(push.target.size));
    MapLevel level = map_levels[push.source];
    vec4 sum = vec4(0.0);
    for (int y = 0; y < level.size.y; ++y) {
        // By rows, so that small terms meet small sums.
        vec4 row = vec4(0.0);
        for (int x = 0; x < level.size.x; ++x) {
            vec3 d = directional_decode((vec2(x, y) + 0.5) / vec2(level.size));
            float weight = ggx_lobe(r, d, push.alpha) * map_angles[directional_angle(level, ivec2(x, y))];
            row += weight * vec4(map_texels[directional_texel(level, ivec2(x, y))], 1.0);
        }
        sum += row;
    }
    texels[directional_texel(push.target, p)] = sum.rgb / sum.a;
}
