#version 460
// What is asked for of the nearest surface at each pixel: clerestory::raster::Output. Outputs that are off are not computed.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const bool WRITE_DISTANCE = true;
layout(constant_id = 1) const bool WRITE_POSITION = true;
layout(constant_id = 2) const bool WRITE_NORMALS = true;
layout(constant_id = 3) const bool WRITE_WEIGHTS = true;
layout(constant_id = 4) const bool WRITE_TEXTURE_COORDINATES = true;
layout(constant_id = 5) const bool WRITE_OBJECT = true;
layout(constant_id = 6) const bool HAS_TEXTURES = true;
layout(constant_id = 7) const bool HAS_VERTEX_COLORS = true;
layout(constant_id = 8) const bool HAS_SHADING_NORMALS = true;
layout(constant_id = 9) const bool HAS_ALPHA = true;
layout(constant_id = 10) const bool HAS_NORMAL_MAPS = true;
layout(constant_id = 11) const bool INTERPOLATED = true;  // attributes by the rasterizer, not by rays
layout(constant_id = 12) const bool MASKED = true;        // only in the octant of the view

#include "maps/packed_direction.glsl"
#include "raster/hit.glsl"
#include "scene/material.glsl"
#include "scene/normal_map.glsl"

const uint RASTER_NORMAL_BITS = 16u;  // of each coordinate of a packed normal

layout(location = 0) flat in uint raster_triangle;
layout(location = 1) flat in uint raster_view;
layout(location = 2) in vec2 raster_weights;

layout(location = 0) out uint triangle_out;
layout(location = 1) out uint object_out;
layout(location = 2) out uint material_out;
layout(location = 3) out float distance_out;
layout(location = 4) out vec4 position_out;
layout(location = 5) out uvec2 normals_out;
layout(location = 6) out vec2 weights_out;
layout(location = 7) out vec4 texture_coordinates_out;

// Scaled by a power of two, so that the squares of small edges do not vanish.
vec3 front_normal(SceneTriangle t) {
    vec3 e1 = t.b - t.a;
    vec3 e2 = t.c - t.a;
    vec3 longest = max(abs(e1), abs(e2));
    int exponent;
    frexp(max(longest.x, max(longest.y, longest.z)), exponent);
    vec3 normal = cross(ldexp(e1, ivec3(-exponent)), ldexp(e2, ivec3(-exponent)));
    float size = length(normal);
    return size > 0.0 ? normal / size : vec3(0.0, 0.0, 1.0);
}

void main() {
    SceneTriangle t = load_triangle(raster_triangle);
    RasterView view = raster_views[raster_view];
    if (MASKED && !raster_is_in_octant(view, gl_FragCoord.xy)) {
        discard;
    }
    triangle_out = raster_triangle;
    material_out = t.material;
    if (WRITE_OBJECT) {
        object_out = texelFetch(raster_objects, int(raster_triangle)).x;
    }
    if (WRITE_DISTANCE || WRITE_POSITION || WRITE_NORMALS || WRITE_WEIGHTS || WRITE_TEXTURE_COORDINATES || HAS_ALPHA) {
        RasterHit hit;
        if (INTERPOLATED) {
            hit = raster_interpolated(view, t, raster_weights);
        } else {
            hit = raster_hit(view, t, gl_FragCoord.xy);
        }
        vec3 w = hit.weights;
        uvec3 v = uvec3(0u);
        if (HAS_TEXTURES || HAS_VERTEX_COLORS || HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) {
            v = load_vertices(raster_triangle);
        }
        vec4 uvs = vec4(0.0);
        if (HAS_TEXTURES) {
            uvs = interpolate_attribute(scene_uvs, v, w);
        }
        if (HAS_ALPHA) {
            SceneMaterial m = load_material(t.material);
            vec4 color = vec4(1.0);
            if (HAS_VERTEX_COLORS) {
                color = interpolate_attribute(scene_colors, v, w);
            }
            if (material_coverage(m, material_base_color(m, uvs, color).a) <= 0.0) {
                discard;
            }
        }
        distance_out = hit.distance;
        position_out = vec4(t.a + (w.y * (t.b - t.a) + w.z * (t.c - t.a)), 1.0);
        weights_out = w.yz;
        texture_coordinates_out = uvs;
        if (WRITE_NORMALS) {
            vec3 front = front_normal(t);
            vec3 shading = front;
            if (HAS_SHADING_NORMALS) {
                vec3 n = interpolate_attribute(scene_normals, v, w).xyz;
                float squared = dot(n, n);
                shading = squared > 0.0 ? n * inversesqrt(squared) : front;
                shading = dot(shading, front) < 0.0 ? -shading : shading;
            }
            if (HAS_NORMAL_MAPS) {
                SceneMaterial m = load_material(t.material);
                if (m.normal_texture != NO_TEXTURE) {
                    vec4 tangent = interpolate_attribute(scene_tangents, v, w);
                    shading = mapped_normal(shading, tangent, sample_texture(m.normal_texture, uvs).xyz, m.normal_scale);
                }
            }
            normals_out = uvec2(pack_octahedral(front, RASTER_NORMAL_BITS), pack_octahedral(shading, RASTER_NORMAL_BITS));
        }
    }
}
