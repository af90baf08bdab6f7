// What a path meets: position, normals and material parameters at a hit.
//
// Opaque and thin surfaces are the same from both sides; only emission knows a front (the side from which vertices run counter-clockwise).
// Expects the constants of path_features.glsl.
#ifndef CLERESTORY_TRANSPORT_SURFACE_GLSL
#define CLERESTORY_TRANSPORT_SURFACE_GLSL

#include "accel/offset.glsl"
#include "accel/ray.glsl"
#include "scene/material.glsl"
#include "transport/bsdf.glsl"
#include "transport/shading_normal.glsl"

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
};

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec3 w) { return w.x * a + w.y * b + w.z * c; }

Surface surface_at(Hit hit, vec3 scene_lower, vec3 scene_upper) {
    SceneTriangle triangle = scene_triangles[hit.triangle];
    uvec3 v = triangle.vertices;
    vec3 a = scene_positions[v.x];
    vec3 b = scene_positions[v.y];
    vec3 c = scene_positions[v.z];
    vec3 w = vec3(1.0 - hit.barycentrics.x - hit.barycentrics.y, hit.barycentrics);
    Surface s;
    s.point = surface_point(a, b, c, hit.barycentrics, scene_reach(interpolate(a, b, c, w), scene_lower, scene_upper));
    vec3 normal = cross(b - a, c - a);
    s.double_area = length(normal);
    s.geometric_normal = normal / s.double_area;
    s.shading_normal = s.geometric_normal;
    if (HAS_SHADING_NORMALS) {
        vec3 n = interpolate(scene_normals[v.x], scene_normals[v.y], scene_normals[v.z], w);
        float squared = dot(n, n);
        if (squared > 0.0) {
            n *= inversesqrt(squared);
            s.shading_normal = dot(n, s.geometric_normal) < 0.0 ? -n : n;
        }
    }
    s.uvs = vec4(0.0);
    if (HAS_TEXTURES) {
        s.uvs = interpolate(scene_uvs[v.x], scene_uvs[v.y], scene_uvs[v.z], w);
    }
    s.tangent = vec4(0.0);
    if (HAS_NORMAL_MAPS) {
        s.tangent = interpolate(scene_tangents[v.x], scene_tangents[v.y], scene_tangents[v.z], w);
    }
    s.color = vec4(1.0);
    if (HAS_VERTEX_COLORS) {
        s.color = interpolate(scene_colors[v.x], scene_colors[v.y], scene_colors[v.z], w);
    }
    s.material = triangle.material;
    s.light = triangle.light;
    return s;
}

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
    if (HAS_CONDUCTOR && (m.flags & MATERIAL_CONDUCTOR) != 0u) {
        b.conductor_eta = m.conductor_eta;
        b.conductor_k = m.conductor_k;
        b.conductor_average = m.conductor_average;
        b.flags |= BSDF_CONDUCTOR;
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
