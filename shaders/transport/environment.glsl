// Latitude-longitude environment maps: directions and texels, in the environment's own frame.
//
// u = atan(x, -z) / 2 pi + 1/2, v = acos(y) / pi. A texel is chosen by its probability and a direction evenly over its solid angle,
// so that densities stay finite at the poles. Method and tables: transport/environment.rs.
// Expects: what distribution.glsl expects.
#ifndef CLERESTORY_TRANSPORT_ENVIRONMENT_GLSL
#define CLERESTORY_TRANSPORT_ENVIRONMENT_GLSL

#include "transport/distribution.glsl"
#include "transport/warp.glsl"

vec2 environment_uv(vec3 w) {
    // The arc tangent keeps its precision at the poles, where the arc cosine loses it.
    // At the poles themselves, where it is not defined, any azimuth does.
    float azimuth = w.x == 0.0 && w.z == 0.0 ? 0.0 : atan(w.x, -w.z);
    return vec2(azimuth * (0.5 * INV_PI) + 0.5, atan(length(w.xz), w.y) * INV_PI);
}

vec3 environment_direction(vec2 uv) {
    float phi = 2.0 * PI * (uv.x - 0.5);
    float theta = PI * uv.y;
    return vec3(sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi));
}

uvec2 environment_texel(vec2 uv, uvec2 size) { return min(uvec2(clamp(uv, 0.0, 1.0) * vec2(size)), size - 1u); }

// A direction: u_texel chooses the texel, which is handed out too, u_within the direction inside it. Its density is that of the texel, which
// the host computes: solid angles of thin texels are beyond the precision that devices promise for sines.
vec3 environment_sample(uint base, uvec2 size, vec2 u_texel, vec2 u_within, out uvec2 texel) {
    texel = distribution_sample_2d(base, size, u_texel);
    // Heights are counted from the nearer pole, where 1 - cos keeps its precision: 1 - cos = 2 sin^2 of half the angle.
    bool south = 2u * texel.y >= size.y;
    float row = float(south ? size.y - 1u - texel.y : texel.y);
    float half_step = 0.5 * PI / float(size.y);
    float s0 = sin(row * half_step);
    float s1 = sin((row + 1.0) * half_step);
    float d = 2.0 * mix(s0 * s0, s1 * s1, south ? 1.0 - u_within.y : u_within.y);
    float r = sqrt(max(0.0, d * (2.0 - d)));
    float phi = 2.0 * PI * ((float(texel.x) + u_within.x) / float(size.x) - 0.5);
    return vec3(r * sin(phi), south ? d - 1.0 : 1.0 - d, -r * cos(phi));
}

#endif
