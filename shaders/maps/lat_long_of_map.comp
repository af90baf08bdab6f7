#version 460
// A latitude-longitude map of a map of another kind: means of look-ups over each texel. Guarantees and twin: maps/to_lat_long.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "maps/directional_map_set.glsl"

// Texels of border about the latitude-longitude map, which are left as they are.
layout(constant_id = 123) const int LAT_LONG_BORDER = 0;

layout(push_constant, scalar) uniform Push {
    MapLevel lat_long;
    int samples;  // along each side of a texel
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer LatLongTexels { vec3 lat_long_texels[]; };

// The mean over a texel of a latitude-longitude map of that size, weighted by solid angle.
vec3 lat_long_texel(ivec2 texel, ivec2 size, int samples) {
    vec3 sum = vec3(0.0);
    float whole = 0.0;
    for (int i = 0; i < samples * samples; ++i) {
        vec2 part = (vec2(i % samples, i / samples) + 0.5) / float(samples);
        vec2 uv = (vec2(texel) + part) / vec2(size);
        float weight = lat_long_density(uv);
        sum += weight * directional_look_up(lat_long_decode(uv), 0.0);
        whole += weight;
    }
    return sum / whole;
}

void main() {
    int i = int(invocation_index());
    ivec2 size = push.lat_long.size;
    if (i >= size.x * size.y) {
        return;
    }
    ivec2 texel = ivec2(i % size.x, i / size.x);
    ivec2 place = texel + LAT_LONG_BORDER;
    uint at = push.lat_long.first + uint(place.y * (size.x + 2 * LAT_LONG_BORDER) + place.x);
    lat_long_texels[at] = lat_long_texel(texel, size, push.samples);
}
