// What a path meets: position, normals and material parameters at a hit.
//
// Opaque and thin surfaces are the same from both sides; only emission knows a front (the side from which vertices run counter-clockwise).
// Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_SURFACE_GLSL
#define CLERESTORY_TRANSPORT_SURFACE_GLSL

#include "accel/offset.glsl"
#include "accel/ray.glsl"
#include "scene/material.glsl"
#include "transport/bsdf.glsl"
#include "transport/shading_normal.glsl"

const uint EXPONENT_BITS = 0x7F800000u;
// Sum of the exponent bits of a power of two and of its reciprocal.
const uint RECIPROCAL_EXPONENTS = 0x7F000000u;

struct Surface {
    SurfacePoint point;
    vec3 geometric_normal;  // unit, to the front
    vec3 shading_normal;    // unit, on the same side
    vec4 tangent;           // of the normal map's frame
    vec4 uvs;
    vec4 color;
    float double_area;
    uint material;
    uint light;
    uint around;            // material of the body that a body is inside of, or all bits set
};

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec3 w) { return w.x * a + w.y * b + w.z * c; }

Surface surface_at(Hit hit, vec3 scene_lower, vec3 scene_upper) {
    SceneInstance at = instance_of(hit.triangle);
    SceneTriangle triangle = load_triangle_of(at, hit.triangle);
    vec3 a = triangle.a;
    vec3 b = triangle.b;
    vec3 c = triangle.c;
    vec3 w = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    Surface s;
    s.point = surface_point(a, b, c, hit.barycentrics, scene_reach(interpolate(a, b, c, w), scene_lower, scene_upper));
    // Scaled by a power of two, so that the squares of small edges do not vanish.
    vec3 e1 = b - a;
    vec3 e2 = c - a;
    float longest = largest_component(max(abs(e1), abs(e2)));
    float scale = uintBitsToFloat(RECIPROCAL_EXPONENTS - (floatBitsToUint(longest) & EXPONENT_BITS));
    vec3 normal = cross(scale * e1, scale * e2);
    float size = length(normal);
    s.double_area = size / scale / scale;
    s.geometric_normal = size > 0.0 ? normal / size : vec3(0.0, 0.0, 1.0);
    s.shading_normal = s.geometric_normal;
    uvec3 v = uvec3(0u);
    if (HAS_SHADING_NORMALS || HAS_TEXTURES || HAS_NORMAL_MAPS || HAS_VERTEX_COLORS) {
        v = load_vertices_of(at, hit.triangle);
    }
    if (HAS_SHADING_NORMALS) {
        vec3 n = interpolate(load_normal(at, v.x), load_normal(at, v.y), load_normal(at, v.z), w);
        float squared = dot(n, n);
        if (squared > 0.0) {
            n *= inversesqrt(squared);
            s.shading_normal = dot(n, s.geometric_normal) < 0.0 ? -n : n;
        }
    }
    s.uvs = vec4(0.0);
    if (HAS_TEXTURES) {
        count_quarters(3u);
        s.uvs = interpolate_attribute(scene_uvs, v, w);
    }
    s.tangent = vec4(0.0);
    if (HAS_NORMAL_MAPS) {
        s.tangent = interpolate(load_tangent(at, v.x), load_tangent(at, v.y), load_tangent(at, v.z), w);
    }
    s.color = vec4(1.0);
    if (HAS_VERTEX_COLORS) {
        count_quarters(3u);
        s.color = interpolate_attribute(scene_colors, v, w);
    }
    s.material = triangle.material;
    s.light = triangle.light;
    s.around = triangle.around - 1u;
    return s;
}

// Quarters of a material that a scene's surfaces read: base colour; emission and flags; the layer and the metal, with their index and what transmits; the way inside;
// how metallic; textures.
uint surface_material_quarters() {
    bool conductor = HAS_EXACT_CONDUCTOR || HAS_SCHLICK_CONDUCTOR || HAS_COMPENSATED_CONDUCTOR || HAS_TINTED_CONDUCTOR || HAS_SIMPLIFIED_CONDUCTOR
        || HAS_TABLE_CONDUCTOR;
    bool flags = HAS_AREA_LIGHTS || HAS_UNLIT || HAS_METAL || conductor || HAS_PHONG;
    bool layer = HAS_METAL || HAS_SPECULAR_LAYER || HAS_TRANSMISSION;
    bool inside = HAS_TRANSMISSION || HAS_ABSORPTION;
    return 1u + uint(flags) + (layer ? 4u : 0u) + uint(inside) + uint(HAS_METAL || HAS_TEXTURES || HAS_NORMAL_MAPS) + (HAS_TEXTURES ? 2u : 0u);
}

// And of that of a lamp.
uint light_material_quarters() { return 1u + (HAS_TEXTURES ? 1u : 0u) + (HAS_ALPHA ? 2u : 0u); }

vec4 surface_base_color(SceneMaterial m, Surface s) { return material_base_color(m, s.uvs, s.color); }

// Radiance that the surface emits towards wo.
vec3 surface_emission(SceneMaterial m, Surface s, vec3 wo) {
    if (HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u) {
        return surface_base_color(m, s).rgb;
    }
    bool shows = (m.flags & MATERIAL_DOUBLE_SIDED) != 0u || dot(wo, s.geometric_normal) > 0.0;
    return HAS_AREA_LIGHTS && shows ? m.emission * material_texture(m.emission_texture, s.uvs).rgb : vec3(0.0);
}

Bsdf surface_bsdf(SceneMaterial m, Surface s) {
    vec3 base_color = surface_base_color(m, s).rgb;
    vec4 metallic_roughness = material_texture(m.metallic_roughness_texture, s.uvs);
    float transmission = m.transmission * material_texture(m.transmission_texture, s.uvs).r;
    float specular = m.specular * material_texture(m.specular_texture, s.uvs).a;
    vec3 specular_color = m.specular_color * material_texture(m.specular_color_texture, s.uvs).rgb;
    Bsdf b = bsdf_gltf(base_color, m.metallic * metallic_roughness.b, m.roughness * metallic_roughness.g, transmission, m.ior,
                       specular, specular_color, m.thickness);
    if (HAS_EXACT_CONDUCTOR && (m.flags & MATERIAL_EXACT_CONDUCTOR) != 0u) {
        b.conductor_a = m.conductor_a;
        b.conductor_b = m.conductor_b;
        b.conductor_c = m.conductor_c;
        b.flags |= BSDF_EXACT_CONDUCTOR;
    }
    // The forms' flags of materials are those of scattering functions, shifted.
    uint form = (m.flags >> MATERIAL_FORM_SHIFT) & conductor_flags() & ~BSDF_EXACT_CONDUCTOR;
    if ((HAS_SCHLICK_CONDUCTOR || HAS_COMPENSATED_CONDUCTOR || HAS_TINTED_CONDUCTOR || HAS_SIMPLIFIED_CONDUCTOR || HAS_TABLE_CONDUCTOR) && form != 0u) {
        b.conductor_a = m.conductor_a;
        b.conductor_b = m.conductor_b;
        b.conductor_c = m.conductor_c;
        b.flags |= form;
    }
    if (HAS_CLASSIC_MICROFACETS) {
        b.flags |= (m.flags >> MATERIAL_FORM_SHIFT) & BSDF_CLASSIC_FLAGS;
    }
    if (HAS_PHONG && (m.flags & MATERIAL_PHONG) != 0u) {
        b.flags |= BSDF_PHONG;
    }
    return b;
}

// The shading normal with the normal map applied.
vec3 surface_mapped_normal(SceneMaterial m, Surface s) {
    if (!HAS_NORMAL_MAPS || m.normal_texture == NO_TEXTURE) {
        return s.shading_normal;
    }
    return mapped_normal(s.shading_normal, s.tangent, sample_texture(m.normal_texture, s.uvs).xyz, m.normal_scale);
}

#endif
