// Light sampling and the ends of light subpaths, with the densities that each has of what the other finds. Both choose by the tables of emission, which have
// all of a light's power.
//
// Expects: `scene_cdf` with the tables of emission, the constants of transport/features.glsl without a tree of lights.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_LIGHTS_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_LIGHTS_GLSL

#include "transport/emission.glsl"

// Density of a place by light sampling (1/m2), and of that place and a direction by walks (1/(m2 sr)), of a lamp that was met from `wo`.
vec2 lamp_densities(Surface s, SceneMaterial m, vec3 wo) {
    float place = 2.0 * light_choice_probability(s.light, LightReceiver(vec3(0.0), vec3(0.0))) / s.double_area;
    return vec2(place, place * lamp_side_probability(m) * cosine_hemisphere_pdf(abs(dot(s.geometric_normal, wo))));
}

// The same of a direction of the environment, per solid angle; walks have `disk_pdf` of its beam.
vec2 sky_densities(SceneEnvironment e, vec3 local, float disk_pdf) {
    float pdf = environment_choice_probability() * environment_emission_pdf(environment_cdf_base(), environment_size(e), local);
    return vec2(pdf, pdf * disk_pdf);
}

// A light, and a point or a direction of it, as sample_light has them. `emitted` is the density of walks that leave the light so, over that of
// light sampling per solid angle at `from` and the cosine at the light.
LightSample sample_emission(vec3 from, uvec2 word, float disk_pdf, vec3 scene_lower, vec3 scene_upper, out float emitted) {
    uvec3 fresh = pcg3d(uvec3(word, 0u));
    LightChoice choice = choose_light_by_power(word, fresh.x);
    LightPoint point;
    LightSample result = sample_chosen_light(choice, from, word, fresh.yz, true, scene_lower, scene_upper, point);
    emitted = disk_pdf;
    if (result.infinite) {
        return result;
    }
    vec3 way = point.point.position - from;
    float squared = dot(way, way);
    if (HAS_AREA_LIGHTS && choice.light.kind == LIGHT_TRIANGLE) {
        float cos_there = abs(dot(point.normal, result.direction));
        emitted = lamp_side_probability(load_material(point.surface.material)) * cosine_hemisphere_pdf(cos_there) / squared;
    } else {
        emitted = cone_pdf(punctual_one_minus_cos(choice.light)) / squared;
    }
    return result;
}

#endif
