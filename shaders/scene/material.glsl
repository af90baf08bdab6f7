// Vertex attributes, base colour and coverage of materials. Expects the bool constants HAS_TEXTURES and HAS_VERTEX_COLORS.
#ifndef CLERESTORY_SCENE_MATERIAL_GLSL
#define CLERESTORY_SCENE_MATERIAL_GLSL

#include "scene/texture.glsl"

// Exact where all corners are equal: white vertex colours change no bit.
vec4 interpolate(vec4 a, vec4 b, vec4 c, vec3 w) { return a + (w.y * (b - a) + w.z * (c - a)); }

#define interpolate_attribute(ATTRIBUTE, VERTICES, WEIGHTS) \
    interpolate(texelFetch(ATTRIBUTE, int((VERTICES).x)), texelFetch(ATTRIBUTE, int((VERTICES).y)), \
                texelFetch(ATTRIBUTE, int((VERTICES).z)), WEIGHTS)

vec4 material_texture(uint texture_index, vec4 uvs) {
    return HAS_TEXTURES && texture_index != NO_TEXTURE ? sample_texture(texture_index, uvs) : vec4(1.0);
}

vec4 material_base_color(SceneMaterial m, vec4 uvs, vec4 color) {
    return vec4(m.base_color, m.base_alpha) * material_texture(m.base_color_texture, uvs) * color;
}

// Share of the surface that is there: 0 or 1 for a mask, alpha for a blend, 1 otherwise (glTF 2.0, 3.9.4).
float material_coverage(SceneMaterial m, float alpha) {
    if ((m.flags & MATERIAL_MASK) != 0u) {
        return alpha >= m.alpha_cutoff ? 1.0 : 0.0;
    }
    return (m.flags & MATERIAL_BLEND) != 0u ? alpha : 1.0;
}

#endif
