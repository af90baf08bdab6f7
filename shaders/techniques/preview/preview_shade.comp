#version 460
// Radiance of the surfaces in a G-buffer: emission, point, spot and directional lights with shadow maps, and light from a probe.
//
// One kernel for cameras and for maps of directions: what is seen, from where, and where its radiance goes is the frame's. Sources and bias:
// techniques/preview/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"

// What is seen is an octahedron of directions about the origin.
layout(constant_id = 140) const bool SEES_ALL_DIRECTIONS = false;
layout(constant_id = 141) const bool HAS_PROBE = true;
layout(constant_id = 142) const bool HAS_SHADOWS = true;
layout(constant_id = 143) const bool HAS_SUN_SHADOWS = true;

#include "invocation.glsl"
#include "raster/omni_shadow_set.glsl"
#include "raster/view_shadow.glsl"
#include "scene/bindings.glsl"
#include "techniques/preview/frame.glsl"
#include "techniques/preview/probe.glsl"
#include "transport/light_choice.glsl"

layout(set = 0, binding = 0) uniform usampler2D seen_triangles;
layout(set = 0, binding = 1) uniform sampler2D seen_weights;
layout(set = 0, binding = 2, scalar) restrict readonly buffer Frames { PreviewFrame frames[]; };
// The word `spare` is the number of the light's shadow map among those of its kind.
layout(set = 0, binding = 3, scalar) restrict readonly buffer Lights { SceneLight lights[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer Radiance { vec3 radiance[]; };
// Shadow maps of directional lights.
layout(set = 0, binding = 5, scalar) restrict readonly buffer SunViews { ShadowView sun_views[]; };
layout(set = 0, binding = 6, scalar) restrict readonly buffer ViewDistances { float view_distances[]; };

#include "raster/view_shadow_set.glsl"

layout(push_constant, scalar) uniform Push {
    uint frame;
    uint first_pixel;  // of those that are shaded together
} push;

// Radiance from a unit direction of the map's axes, filtered by a lobe of width alpha.
vec3 probe_look_up(vec3 d, float alpha) {
    PreviewFrame frame = frames[push.frame];
    return directional_look_up(d, probe_level(frame, alpha));
}

// What one light adds.
vec3 preview_direct(uint index, Surface s, Bsdf b, mat3 axes, vec3 facing, vec3 wo) {
    SceneLight light = lights[index];
    vec3 direction;
    vec3 arriving = light.strength;
    bool is_distant = light.kind == LIGHT_DIRECTIONAL;
    if (is_distant) {
        direction = -light.direction;
    } else {
        vec3 to = light.position - s.point.position;
        float squared = dot(to, to);
        if (!(squared > 0.0)) {
            return vec3(0.0);
        }
        direction = to * inversesqrt(squared);
        float cos_angle = -dot(light.direction, direction);
        arriving *= (light.kind == LIGHT_SPOT ? spot_falloff(cos_angle, light.cos_inner, light.cos_outer) : 1.0) / squared;
    }
    vec3 wi = direction * axes;
    if (wi.z <= 0.0 || dot(facing, direction) <= 0.0 || arriving == vec3(0.0)) {
        return vec3(0.0);
    }
    vec3 reflected = arriving * bsdf_eval(b, wo, wi, LOBE_REFLECTION);
    if (light.spare != PREVIEW_NO_SHADOW && reflected != vec3(0.0)) {
        float slack = dot(abs(facing), s.point.error);
        int side = frames[push.frame].shadow_side;
        if (HAS_SUN_SHADOWS && is_distant) {
            reflected *= view_shadow_visibility(sun_views[light.spare], light.spare, side, SHADOW_WIDTH, s.point.position, facing, slack);
        } else if (HAS_SHADOWS) {
            reflected *= omni_shadow_visibility(light.spare, side, light.position, s.point.position, facing, slack);
        }
    }
    return reflected;
}

vec3 preview_surface(uint triangle, vec2 weights, vec3 origin, vec3 direction) {
    PreviewFrame frame = frames[push.frame];
    Surface s = surface_at(Hit(0.0, weights, triangle), frame.lower, frame.upper);
    SceneMaterial m = load_material(s.material);
    vec3 to_eye = -direction;
    vec3 light = surface_emission(m, s, to_eye);
    if (HAS_UNLIT && (m.flags & MATERIAL_UNLIT) != 0u) {
        return light;
    }
    Bsdf b = surface_bsdf(m, s);
    vec3 facing = dot(to_eye, s.geometric_normal) < 0.0 ? -s.geometric_normal : s.geometric_normal;
    vec3 normal = adapt_shading_normal(surface_mapped_normal(m, s), facing, to_eye);
    mat3 axes;
    axes[2] = normal;
    orthonormal_basis(normal, axes[0], axes[1]);
    vec3 wo = to_eye * axes;
    for (uint i = 0u; i < frame.light_count; ++i) {
        light += preview_direct(i, s, b, axes, facing, wo);
    }
    if (HAS_PROBE) {
        light += cosine_lobes(b, wo.z, false, LOBE_REFLECTION).seen * probe_look_up(normal, 1.0);
        vec3 shine = microfacet_albedo(b, wo.z);
        if (shine != vec3(0.0)) {
            light += shine * probe_look_up(normalize(2.0 * wo.z * normal - to_eye), b.alpha);
        }
    }
    return light;
}

void main() {
    PreviewFrame frame = frames[push.frame];
    uint i = push.first_pixel + invocation_index();
    if (i >= frame.width * frame.height) {
        return;
    }
    uvec2 pixel = uvec2(i % frame.width, i / frame.width);
    uint triangle = texelFetch(seen_triangles, ivec2(pixel), 0).x;
    bool is_nothing = triangle == NO_HIT;
    if (is_nothing ? frame.has_background == 0u : triangle < frame.first_triangle || triangle >= frame.end_triangle) {
        return;
    }
    vec2 place = (2.0 * vec2(pixel) + 1.0) / vec2(frame.width, frame.height) - 1.0;
    vec3 origin = frame.origin;
    vec3 direction;
    if (SEES_ALL_DIRECTIONS) {
        direction = octahedron_decode(place);
    } else {
        vec3 across = place.x * frame.right + place.y * frame.down;
        origin += frame.is_parallel != 0u ? across : vec3(0.0);
        direction = normalize(frame.is_parallel != 0u ? frame.forward : frame.forward + across);
    }
    vec3 light = vec3(0.0);
    if (is_nothing) {
        if (HAS_ENVIRONMENT) {
            SceneEnvironment e = load_environment();
            light = environment_radiance(e, world_to_environment(e, direction));
        }
    } else {
        light = preview_surface(triangle, texelFetch(seen_weights, ivec2(pixel), 0).xy, origin, direction);
    }
    radiance[frame.first_pixel + pixel.y * frame.stride + pixel.x] = light;
}
