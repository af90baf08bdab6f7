// Direct light: choosing a light by its power, a point or direction on it, and the densities that multiple importance sampling needs.
//
// One point of the unit square chooses the light and the place on it, so that the points of a sequence keep their strata on each light;
// triangles are sampled uniformly by area, the environment by its luminance above what is left to scattered rays. BG-2, BG-3.
// Expects the constants of transport/features.glsl.
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

// Radiance from a direction in the environment's frame, and the density per solid angle with which light sampling that has chosen the
// environment finds it.
vec4 environment_look_up(SceneEnvironment e, vec3 local) { return environment_look_up(environment_size(e), e.left_out, local); }

vec3 environment_radiance(SceneEnvironment e, vec3 local) { return environment_look_up(e, local).rgb; }

// The environment is the last light.
float environment_choice_probability() { return distribution_probability(0u, light_count() - 1u); }

// Density with which light sampling finds the point of a triangle light that a ray has hit at distance t.
float triangle_light_pdf(Surface s, vec3 direction, float t) {
    float choice = distribution_probability(0u, s.light);
    return area_to_solid_angle(2.0 * choice / s.double_area, t * t, abs(dot(s.geometric_normal, direction)));
}

// A point of a light with a place in the scene, as it is chosen whatever it lights.
struct LightPoint {
    SceneLight light;
    float probability;  // of the light
    Surface surface;    // of a triangle
    SurfacePoint point;
    vec3 normal;        // of a triangle; zero otherwise
};

LightSample no_light() { return LightSample(vec3(0.0), vec3(0.0), 0.0, SurfacePoint(vec3(0.0), vec3(0.0)), vec3(0.0), false); }

// A light by the first of two words, which becomes the place within that light's share.
SceneLight choose_light(inout uvec2 word, uint fresh, out float probability) {
    return load_light(distribution_sample(0u, light_count(), word.x, fresh, probability));
}

// The point of a triangle that two words choose, evenly by area, or that of a point or spot.
LightPoint light_point(SceneLight light, float probability, uvec2 word, vec3 scene_lower, vec3 scene_upper) {
    LightPoint p;
    p.light = light;
    p.probability = probability;
    p.point = SurfacePoint(light.position, vec3(0.0));
    p.normal = vec3(0.0);
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        vec2 u = vec2(unit_float(word.x), unit_float(word.y));
        p.surface = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), scene_lower, scene_upper);
        p.point = p.surface.point;
        p.normal = p.surface.geometric_normal;
    }
    return p;
}

// The light of a point of a light seen from `from`.
LightSample light_seen(LightPoint p, vec3 from) {
    LightSample result = no_light();
    result.point = p.point;
    result.normal = p.normal;
    vec3 to = p.point.position - from;
    float squared = dot(to, to);
    if (squared <= 0.0) {
        return result;
    }
    result.direction = to * inversesqrt(squared);
    if (HAS_AREA_LIGHTS && p.light.kind == LIGHT_TRIANGLE) {
        result.pdf = area_to_solid_angle(2.0 * p.probability / p.surface.double_area, squared, abs(dot(p.normal, result.direction)));
        SceneMaterial m = load_material(p.surface.material);
        if (result.pdf > 0.0) {
            result.radiance = surface_emission(m, p.surface, -result.direction) / result.pdf;
        }
        if (HAS_ALPHA) {
            // What a ray would meet there only in part, light sampling must not find in full.
            result.radiance *= material_coverage(m, surface_base_color(m, p.surface).a);
        }
    } else if (HAS_PUNCTUAL_LIGHTS) {
        float cos_angle = -dot(p.light.direction, result.direction);
        float falloff = p.light.kind == LIGHT_SPOT ? spot_falloff(cos_angle, p.light.cos_inner, p.light.cos_outer) : 1.0;
        result.radiance = p.light.strength * (falloff / (squared * p.probability));
    }
    return result;
}

// A light, and a point or a direction of it, by one point of the unit square in two words. Zero radiance when there is nothing to see.
LightSample sample_light(vec3 from, uvec2 word, vec3 scene_lower, vec3 scene_upper) {
    uvec3 fresh = pcg3d(uvec3(word, 0u));
    float probability;
    SceneLight light = choose_light(word, fresh.x, probability);
    LightSample result = no_light();
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment e = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(e), e.left_out, false, word, fresh.yz, found);
        result.direction = environment_to_world(e, local);
        result.pdf = found.a * probability;
        result.radiance = result.pdf > 0.0 ? found.rgb / result.pdf : vec3(0.0);
        result.infinite = true;
        return result;
    }
    if (HAS_PUNCTUAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        result.direction = -light.direction;
        result.radiance = light.strength / probability;
        result.infinite = true;
        return result;
    }
    return light_seen(light_point(light, probability, word, scene_lower, scene_upper), from);
}

#endif
