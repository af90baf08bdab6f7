#version 460
// Points to the texels of an octahedron map that their centres lie in: the least distance, and, in a second run, the least number of those
// that are as near.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(constant_id = 0) const bool RECTANGULAR = false;
layout(constant_id = 1) const bool NUMBERS = false;  // the second run

#include "accel/ray.glsl"
#include "maps/octahedron.glsl"
#include "raster/splats.glsl"

struct Surfel {
    vec3 position;
    uint number;
};

layout(push_constant, scalar) uniform Push {
    vec3 origin;
    uint count;
    uvec2 size;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Surfels { Surfel surfels[]; };
layout(set = 0, binding = 1, scalar) restrict buffer Texels { SplatTexel texels[]; };

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) {
        return;
    }
    Surfel surfel = surfels[index];
    precise vec3 p = surfel.position - push.origin;
    precise float squared = p.x * p.x + p.y * p.y + p.z * p.z;
    // What rays cannot reach has no place, and the origin no direction; comparisons are false for NaN.
    if (!(all(lessThanEqual(abs(p), vec3(MAX_COORDINATE))) && squared > 0.0)) {
        return;
    }
    vec2 place = RECTANGULAR ? octahedron_rectangular_encode(p) * vec2(0.5, 1.0) : octahedron_encode(p);
    uvec2 at = min(uvec2((0.5 + 0.5 * place) * vec2(push.size)), push.size - 1u);
    uint texel = splat_texel(SplatLevel(0u, push.size), at);
    uint distance_bits = floatBitsToUint(sqrt(squared));
    if (!NUMBERS) {
        atomicMin(texels[texel].distance_bits, distance_bits);
    } else if (texels[texel].distance_bits == distance_bits) {
        atomicMin(texels[texel].number, surfel.number);
    }
}
