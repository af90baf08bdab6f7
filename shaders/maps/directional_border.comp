#version 460
// The border of a level: texels of its inside, by the map's topology.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "maps/directional_map.glsl"

layout(push_constant, scalar) uniform Push { MapLevel level; } push;

layout(set = 0, binding = 0, scalar) restrict buffer Texels { vec3 texels[]; };

// Row or column of the near or far border, one after the other.
int beyond(int i, int size) { return i < DIRECTIONAL_BORDER ? i - DIRECTIONAL_BORDER : size + i - DIRECTIONAL_BORDER; }

void main() {
    int i = int(gl_GlobalInvocationID.x);
    ivec2 size = push.level.size;
    int both = 2 * DIRECTIONAL_BORDER;
    int width = size.x + both;
    // The rows above and below, then the columns at both sides.
    int rows = both * width;
    if (i >= rows + both * size.y) {
        return;
    }
    ivec2 p = i < rows ? ivec2(i % width - DIRECTIONAL_BORDER, beyond(i / width, size.y)) :
                         ivec2(beyond((i - rows) % both, size.x), (i - rows) / both);
    texels[directional_texel(push.level, p)] = texels[directional_texel(push.level, directional_wrap(p, size))];
}
