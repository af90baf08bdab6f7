// Texture look-ups in f32, without mip levels: exact on every driver, since nothing is left to a sampler's fixed-point weights.
// Twin of clerestory::scene::texture.
#ifndef CLERESTORY_SCENE_TEXTURE_GLSL
#define CLERESTORY_SCENE_TEXTURE_GLSL

#include "srgb.glsl"
#include "scene/bindings.glsl"

const uint TEXTURE_SRGB = 1u;
const uint TEXTURE_NEAREST = 2u;
const uint TEXTURE_UV1 = 4u;
const uint TEXTURE_WRAP_U_SHIFT = 3u;
const uint TEXTURE_WRAP_V_SHIFT = 5u;
const uint WRAP_REPEAT = 0u;
const uint WRAP_MIRRORED = 1u;
const uint WRAP_CLAMP = 2u;
const uint WRAP_MASK = 3u;
// Distance from the origin, in texels, beyond which coordinates no longer tell neighbouring texels apart.
const float TEXTURE_COORDINATE_LIMIT = 16777216.0;

uint wrap_texel(int i, uint size, uint mode) {
    int n = int(size);
    if (mode == WRAP_REPEAT) {
        int r = i % n;
        return uint(r < 0 ? r + n : r);
    }
    if (mode == WRAP_MIRRORED) {
        int period = 2 * n;
        int r = i % period;
        r = r < 0 ? r + period : r;
        return uint(r < n ? r : period - 1 - r);
    }
    return uint(clamp(i, 0, n - 1));
}

vec4 fetch_texel(SceneTexture t, ivec2 p) {
    uvec2 size = uvec2(t.size & 0xFFFFu, t.size >> 16u);
    uint x = wrap_texel(p.x, size.x, (t.flags >> TEXTURE_WRAP_U_SHIFT) & WRAP_MASK);
    uint y = wrap_texel(p.y, size.y, (t.flags >> TEXTURE_WRAP_V_SHIFT) & WRAP_MASK);
    count_fetches(1u, 1u);
    vec4 c = unpackUnorm4x8(texelFetch(scene_texels, int(t.first_texel + y * size.x + x)).x);
    return (t.flags & TEXTURE_SRGB) != 0u ? vec4(linear_from_srgb(c.rgb), c.a) : c;
}

// The texture at the vertex coordinates `uvs` (set 0, set 1). Coordinates are kept where texel numbers are exact integers.
vec4 sample_texture(uint index, vec4 uvs) {
    SceneTexture t = load_texture(index);
    vec3 uv = vec3((t.flags & TEXTURE_UV1) != 0u ? uvs.zw : uvs.xy, 1.0);
    vec2 size = vec2(float(t.size & 0xFFFFu), float(t.size >> 16u));
    vec2 p = clamp(vec2(dot(t.transform_u, uv), dot(t.transform_v, uv)) * size, vec2(-TEXTURE_COORDINATE_LIMIT),
                   vec2(TEXTURE_COORDINATE_LIMIT));
    if ((t.flags & TEXTURE_NEAREST) != 0u) {
        return fetch_texel(t, ivec2(floor(p)));
    }
    p -= 0.5;
    vec2 base = floor(p);
    vec2 w = p - base;
    ivec2 i = ivec2(base);
    return mix(mix(fetch_texel(t, i), fetch_texel(t, i + ivec2(1, 0)), w.x),
               mix(fetch_texel(t, i + ivec2(0, 1)), fetch_texel(t, i + ivec2(1, 1)), w.x), w.y);
}

#endif
