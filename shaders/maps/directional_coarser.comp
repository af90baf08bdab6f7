#version 460
// A level from the next finer one: means of four texels by solid angle, which keep the integral over the sphere.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/directional_map.glsl"

layout(push_constant, scalar) uniform Push {
    MapLevel fine;
    MapLevel coarse;
    int layers;
} push;

layout(set = 0, binding = 0, scalar) restrict buffer Texels { vec3 texels[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer SolidAngles { float solid_angles[]; };

void main() {
    int i = int(invocation_index());
    if (i >= push.coarse.size.x * push.coarse.size.y * push.layers) {
        return;
    }
    // Layers lie one below the other; several have no border.
    ivec2 p = ivec2(i % push.coarse.size.x, i / push.coarse.size.x);
    vec3 sum = vec3(0.0);
    float whole = 0.0;
    for (int child = 0; child < 4; ++child) {
        ivec2 q = 2 * p + ivec2(child & 1, child >> 1);
        float angle = solid_angles[directional_angle(push.fine, ivec2(q.x, q.y % push.fine.size.y))];
        sum += angle * texels[directional_texel(push.fine, q)];
        whole += angle;
    }
    // Outside of discs there are no directions.
    texels[directional_texel(push.coarse, p)] = whole > 0.0 ? sum / whole : vec3(0.0);
}
