// Direct light: choosing a light by its power or, among many, for the point that it is to light; a point or direction on it; and the
// densities that multiple importance sampling needs.
//
// One point of the unit square chooses the light and the place on it, so that the points of a sequence keep their strata on each light;
// triangles are sampled uniformly by area, the environment by its luminance above what is left to scattered rays. BG-2, BG-3.
// Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_LIGHT_CHOICE_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_CHOICE_GLSL

#include "scene/bindings.glsl"
#include "transport/environment.glsl"
#include "transport/light_receiver.glsl"
#include "transport/light_tree.glsl"
#include "transport/lights.glsl"
#include "transport/surface.glsl"

// A light, and the probability with which it was chosen.
struct LightChoice {
    uint index;
    SceneLight light;
    float probability;
};

struct LightSample {
    vec3 direction;      // unit, to the light
    vec3 radiance;       // divided by the density
    float pdf;           // solid angle, with the choice of the light; 0 for a light without area
    SurfacePoint point;  // the far end
    vec3 normal;         // of a triangle; zero otherwise
    bool infinite;       // the far end is a direction only
    LightChoice choice;
};

vec3 world_to_environment(SceneEnvironment e, vec3 w) { return vec3(dot(e.right, w), dot(e.up, w), dot(e.back, w)); }

vec3 environment_to_world(SceneEnvironment e, vec3 local) { return e.right * local.x + e.up * local.y + e.back * local.z; }

uvec2 environment_size(SceneEnvironment e) { return uvec2(e.width, e.height); }

// Radiance from a direction in the environment's frame, and the density per solid angle with which light sampling that has chosen the
// environment finds it.
vec4 environment_look_up(SceneEnvironment e, vec3 local) { return environment_look_up(environment_size(e), e.left_out, local); }

vec3 environment_radiance(SceneEnvironment e, vec3 local) { return environment_look_up(e, local).rgb; }

// Probability with which light sampling chooses a light for a point.
float light_choice_probability(uint light, LightReceiver r) {
    if (HAS_LIGHT_TREE) {
        return light_tree_probability(light, r.position, r.normal);
    }
    return distribution_probability(0u, light);
}

// The environment is the last light, whose probability is the same everywhere.
float environment_choice_probability() { return light_choice_probability(light_count() - 1u, LightReceiver(vec3(0.0), vec3(0.0))); }

// Density with which light sampling for a point finds that of a triangle light which a ray from there has hit at distance t.
float triangle_light_pdf(LightReceiver r, Surface s, vec3 direction, float t) {
    float choice = light_choice_probability(s.light, r);
    return area_to_solid_angle(2.0 * choice / s.double_area, t * t, abs(dot(s.geometric_normal, direction)));
}

// A point of a light with a place in the scene.
struct LightPoint {
    LightChoice choice;
    Surface surface;  // of a triangle
    SurfacePoint point;
    vec3 normal;      // of a triangle; zero otherwise
};

LightSample no_light() {
    LightSample none;
    none.direction = vec3(0.0);
    none.radiance = vec3(0.0);
    none.pdf = 0.0;
    none.point = SurfacePoint(vec3(0.0), vec3(0.0));
    none.normal = vec3(0.0);
    none.infinite = false;
    return none;
}

// Of lights without a place of their own the first quarter is enough.
SceneLight load_chosen_light(uint index) {
    count_quarters(HAS_PUNCTUAL_LIGHTS ? LIGHT_QUARTERS : 1u);
    return load_light(index);
}

// A light by its power, whatever it lights, by the first of two words, which becomes the place within that light's share.
LightChoice choose_light_by_power(inout uvec2 word, uint fresh) {
    LightChoice choice;
    choice.index = distribution_sample(0u, light_count(), word.x, fresh, choice.probability);
    choice.light = load_chosen_light(choice.index);
    return choice;
}

// A light for a point, by the first of two words in the same way.
LightChoice choose_light(LightReceiver r, inout uvec2 word, uint fresh) {
    if (HAS_LIGHT_TREE) {
        LightChoice choice;
        choice.index = light_tree_sample(r.position, r.normal, word.x, fresh, choice.probability);
        choice.light = load_chosen_light(choice.index);
        return choice;
    }
    return choose_light_by_power(word, fresh);
}

// Probability with which a light is chosen for a point over that with which it is chosen by its power.
float light_choice_gain(LightChoice by_power, LightReceiver r) {
    return HAS_LIGHT_TREE ? light_tree_probability(by_power.index, r.position, r.normal) / by_power.probability : 1.0;
}

// The point of a triangle that two words choose, evenly by area, or that of a point or spot.
LightPoint light_point(LightChoice choice, uvec2 word, vec3 scene_lower, vec3 scene_upper) {
    LightPoint p;
    p.choice = choice;
    p.point = SurfacePoint(choice.light.position, vec3(0.0));
    p.normal = vec3(0.0);
    if (HAS_AREA_LIGHTS && choice.light.kind == LIGHT_TRIANGLE) {
        vec2 u = vec2(unit_float(word.x), unit_float(word.y));
        p.surface = surface_at(Hit(0.0, square_to_triangle(u).yz, choice.light.triangle), scene_lower, scene_upper);
        p.point = p.surface.point;
        p.normal = p.surface.geometric_normal;
    }
    return p;
}

// The light of a point of a light seen from `from`.
LightSample light_seen(LightPoint p, vec3 from) {
    SceneLight light = p.choice.light;
    LightSample result = no_light();
    result.choice = p.choice;
    result.point = p.point;
    result.normal = p.normal;
    vec3 to = p.point.position - from;
    float squared = dot(to, to);
    if (squared <= 0.0) {
        return result;
    }
    result.direction = to * inversesqrt(squared);
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        result.pdf = area_to_solid_angle(2.0 * p.choice.probability / p.surface.double_area, squared, abs(dot(p.normal, result.direction)));
        count_quarters(light_material_quarters());
        SceneMaterial m = load_material(p.surface.material);
        if (result.pdf > 0.0) {
            result.radiance = surface_emission(m, p.surface, -result.direction) / result.pdf;
        }
        if (HAS_ALPHA) {
            // What a ray would meet there only in part, light sampling must not find in full.
            result.radiance *= material_coverage(m, surface_base_color(m, p.surface).a);
        }
    } else if (HAS_PUNCTUAL_LIGHTS) {
        float cos_angle = -dot(light.direction, result.direction);
        float falloff = light.kind == LIGHT_SPOT ? spot_falloff(cos_angle, light.cos_inner, light.cos_outer) : 1.0;
        result.radiance = light.strength * (falloff / (squared * p.choice.probability));
    }
    return result;
}

// A point or a direction of a light that the first of two words has chosen; `point` is set for lights with a place. Of the environment all light is
// found by the tables of emission, and without them what is not left to scattered rays. Zero radiance when there is nothing to see.
LightSample sample_chosen_light(LightChoice choice, vec3 from, uvec2 word, uvec2 fresh, bool emission, vec3 scene_lower, vec3 scene_upper,
                                out LightPoint point) {
    LightSample result = no_light();
    result.choice = choice;
    if (HAS_ENVIRONMENT && choice.light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment e = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(e), emission ? 0.0 : e.left_out, emission, word, fresh, found);
        result.direction = environment_to_world(e, local);
        result.pdf = found.a * choice.probability;
        result.radiance = result.pdf > 0.0 ? found.rgb / result.pdf : vec3(0.0);
        result.infinite = true;
        return result;
    }
    if (HAS_PUNCTUAL_LIGHTS && choice.light.kind == LIGHT_DIRECTIONAL) {
        result.direction = -choice.light.direction;
        result.radiance = choice.light.strength / choice.probability;
        result.infinite = true;
        return result;
    }
    point = light_point(choice, word, scene_lower, scene_upper);
    return light_seen(point, from);
}

// A light, and a point or a direction of it, by one point of the unit square in two words. Zero radiance when there is nothing to see.
LightSample sample_light(LightReceiver receiver, uvec2 word, vec3 scene_lower, vec3 scene_upper) {
    uvec3 fresh = pcg3d(uvec3(word, 0u));
    LightChoice choice = choose_light(receiver, word, fresh.x);
    LightPoint point;
    return sample_chosen_light(choice, receiver.position, word, fresh.yz, false, scene_lower, scene_upper, point);
}

#endif
