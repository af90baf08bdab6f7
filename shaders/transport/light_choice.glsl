// Direct light: choosing a light by its power, a point or direction on it, and the densities that multiple importance sampling needs.
//
// One draw chooses the light, stratified through the cumulative table; triangles are sampled uniformly by area, the environment by its
// luminance. BG-2, BG-3. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_LIGHT_CHOICE_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_CHOICE_GLSL

#include "scene/bindings.glsl"
#include "transport/environment.glsl"
#include "transport/lights.glsl"
#include "transport/surface.glsl"

struct LightSample {
    vec3 direction;      // unit, to the light
    vec3 radiance;       // divided by the density
    float pdf;           // solid angle, with the choice of the light; 0 for a light without area
    SurfacePoint point;  // the far end
    vec3 normal;         // of a triangle; zero otherwise
    bool infinite;       // the far end is a direction only
};

vec3 world_to_environment(SceneEnvironment e, vec3 w) { return vec3(dot(e.right, w), dot(e.up, w), dot(e.back, w)); }

vec3 environment_to_world(SceneEnvironment e, vec3 local) { return e.right * local.x + e.up * local.y + e.back * local.z; }

uvec2 environment_size(SceneEnvironment e) { return uvec2(e.width, e.height); }

// Radiance of a texel, and the density per solid angle of environment_sample in it.
vec4 load_environment_texel(SceneEnvironment e, uvec2 texel) {
    return uintBitsToFloat(texelFetch(scene_environment, int(ENVIRONMENT_HEADER_QUARTERS + texel.y * e.width + texel.x)));
}

// Bilinear, around in u and clamped at the poles; `local` is in the environment's frame.
vec3 environment_radiance(SceneEnvironment e, vec3 local) {
    vec2 p = environment_uv(local) * vec2(environment_size(e)) - 0.5;
    vec2 base = floor(p);
    vec2 w = p - base;
    int width = int(e.width);
    uvec2 x = uvec2((ivec2(int(base.x)) + ivec2(width, width + 1)) % width);
    uvec2 y = uvec2(clamp(ivec2(int(base.y)) + ivec2(0, 1), ivec2(0), ivec2(int(e.height) - 1)));
    return mix(mix(load_environment_texel(e, uvec2(x.x, y.x)).rgb, load_environment_texel(e, uvec2(x.y, y.x)).rgb, w.x),
               mix(load_environment_texel(e, uvec2(x.x, y.y)).rgb, load_environment_texel(e, uvec2(x.y, y.y)).rgb, w.x), w.y);
}

// The environment is the last light.
float environment_choice_probability() { return distribution_probability(0u, light_count() - 1u); }

// Density with which light sampling finds a direction in which the environment is seen.
float environment_light_pdf(SceneEnvironment e, vec3 local) {
    return environment_choice_probability()
        * load_environment_texel(e, environment_texel(environment_uv(local), environment_size(e))).a;
}

// Density with which light sampling finds the point of a triangle light that a ray has hit at distance t.
float triangle_light_pdf(Surface s, vec3 direction, float t) {
    float choice = distribution_probability(0u, s.light);
    return area_to_solid_angle(2.0 * choice / s.double_area, t * t, abs(dot(s.geometric_normal, direction)));
}

// `choice` picks the light, `u` the point or texel, `within` the direction in a texel. Zero radiance when there is nothing to see.
LightSample sample_light(vec3 from, float choice, vec2 u, vec2 within, vec3 scene_lower, vec3 scene_upper) {
    LightSample result = LightSample(vec3(0.0), vec3(0.0), 0.0, SurfacePoint(vec3(0.0), vec3(0.0)), vec3(0.0), false);
    float probability;
    SceneLight light = load_light(distribution_sample(0u, light_count(), choice, probability));
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        uvec2 texel;
        SceneEnvironment e = load_environment();
        vec3 local = environment_sample(e.cdf_base, environment_size(e), u, within, texel);
        result.direction = environment_to_world(e, local);
        result.pdf = load_environment_texel(e, texel).a * probability;
        result.radiance = environment_radiance(e, local) / result.pdf;
        result.infinite = true;
        return result;
    }
    if (HAS_PUNCTUAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        result.direction = -light.direction;
        result.radiance = light.strength / probability;
        result.infinite = true;
        return result;
    }
    Surface s;
    result.point.position = light.position;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        s = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), scene_lower, scene_upper);
        result.point = s.point;
        result.normal = s.geometric_normal;
    }
    vec3 to = result.point.position - from;
    float squared = dot(to, to);
    if (squared <= 0.0) {
        return result;
    }
    result.direction = to * inversesqrt(squared);
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        result.pdf = area_to_solid_angle(2.0 * probability / s.double_area, squared, abs(dot(result.normal, result.direction)));
        SceneMaterial m = load_material(s.material);
        if (result.pdf > 0.0) {
            result.radiance = surface_emission(m, s, -result.direction) / result.pdf;
        }
        if (HAS_ALPHA) {
            // What a ray would meet there only in part, light sampling must not find in full.
            result.radiance *= material_coverage(m, surface_base_color(m, s).a);
        }
    } else if (HAS_PUNCTUAL_LIGHTS) {
        float cos_angle = -dot(light.direction, result.direction);
        float falloff = light.kind == LIGHT_SPOT ? spot_falloff(cos_angle, light.cos_inner, light.cos_outer) : 1.0;
        result.radiance = light.strength * (falloff / (squared * probability));
    }
    return result;
}

#endif
