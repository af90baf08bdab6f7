// Light that leaves the lights: a light by its power, a point on it evenly, a direction by what it emits there, so that walks of one light carry about the same power.
// Directional lights and the environment send theirs through a disk as large as the scene's bounding sphere.
//
// PM-PH-1: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §3.4.1; area lights and the environment as in Jensen 2001, §5.1.
// Expects: `scene_cdf` with the tables of emission, the constants of transport/features.glsl without a tree of lights.
#ifndef CLERESTORY_TRANSPORT_EMISSION_GLSL
#define CLERESTORY_TRANSPORT_EMISSION_GLSL

#include "transport/bodies.glsl"
#include "transport/light_choice.glsl"

// Whether what leaves the lights has to know which body it is in.
const bool HAS_LAMPS_IN_BODIES = HAS_ABSORPTION || HAS_MEDIA;

struct Emission {
    vec3 origin;
    vec3 direction;
    vec3 power;           // W, over the density
    float probability;    // of the light
    bool infinite;        // it comes through the disk
    float area;           // that it leaves, m2, of both sides of a lamp that shines on both, or of the disk; 0 of a light without
    float side;           // share of a lamp's light that leaves on this side of it
    float direction_pdf;  // sr^-1, of this side; 0 of a directional light, which has but one direction
    uint interior;        // material of the body that it begins in, or OUTSIDE
};

// Share of a lamp's light that leaves on the side of a point.
float lamp_side_probability(SceneMaterial m) { return (m.flags & MATERIAL_DOUBLE_SIDED) != 0u ? 0.5 : 1.0; }

// Of spots' cones, or of the sphere about points.
float punctual_one_minus_cos(SceneLight light) { return light.kind == LIGHT_SPOT ? 1.0 - light.cos_outer : 2.0; }

vec3 in_frame(vec3 local, vec3 z) {
    vec3 x;
    vec3 y;
    orthonormal_basis(z, x, y);
    return local.x * x + local.y * y + local.z * z;
}

// A beam of parallel light through the disk that a sphere about the scene shows to it.
Emission parallel_emission(vec3 direction, vec3 irradiance, float direction_pdf, float probability, vec2 u, vec3 middle, float radius) {
    float area = PI * radius * radius;
    vec3 origin = middle + radius * (in_frame(vec3(square_to_disk(u), 0.0), direction) - direction);
    return Emission(origin, direction, irradiance * area, probability, true, area, 1.0, direction_pdf, OUTSIDE);
}

// What leaves a light by two words for the light and a point of it and two for a direction, in a scene with a bounding sphere of that radius.
Emission emit(uvec2 point, uvec2 direction, vec3 scene_lower, vec3 scene_upper, float radius) {
    uvec3 fresh = pcg3d(uvec3(point.x, direction));
    LightChoice choice = choose_light_by_power(point, fresh.x);
    SceneLight light = choice.light;
    vec2 u = vec2(unit_float(point.x), unit_float(point.y));
    vec2 v = vec2(unit_float(direction.x), unit_float(direction.y));
    vec3 middle = 0.5 * (scene_lower + scene_upper);
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment environment = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(environment), 0.0, true, direction, fresh.yz, found);
        vec3 irradiance = found.rgb / (found.a * choice.probability);
        return parallel_emission(-environment_to_world(environment, local), irradiance, found.a, choice.probability, u, middle, radius);
    }
    if (HAS_PUNCTUAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        return parallel_emission(light.direction, light.strength / choice.probability, 0.0, choice.probability, u, middle, radius);
    }
    uint around = HAS_LAMPS_IN_BODIES ? light.around - 1u : OUTSIDE;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        Surface s = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), scene_lower, scene_upper);
        SceneMaterial m = load_material(s.material);
        float side = lamp_side_probability(m);
        bool turned = side < 1.0 && choose_first(v.x, side);
        vec3 normal = turned ? -s.geometric_normal : s.geometric_normal;
        vec3 local = square_to_cosine_hemisphere(v);
        vec3 w = in_frame(local, normal);
        vec3 origin = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, w);
        float area = 0.5 * s.double_area / side;
        vec3 power = surface_emission(m, s, w) * (PI * area / choice.probability);
        if (HAS_ALPHA) {
            power *= material_coverage(m, surface_base_color(m, s).a);
        }
        if (HAS_LAMPS_IN_BODIES && turned && m.transmission > 0.0 && m.thickness > 0.0) {
            around = s.material;
        }
        return Emission(origin, w, power, choice.probability, false, area, side, cosine_hemisphere_pdf(local.z), around);
    }
    // Where no light can be chosen, what leaves carries nothing, somewhere.
    Emission e = Emission(light.position, vec3(0.0, 0.0, 1.0), vec3(0.0), choice.probability, false, 0.0, 1.0, 0.0, around);
    if (HAS_PUNCTUAL_LIGHTS) {
        float one_minus_cos = punctual_one_minus_cos(light);
        vec3 local = square_to_cone(v, one_minus_cos);
        bool spot = light.kind == LIGHT_SPOT;
        e.direction = spot ? in_frame(local, light.direction) : local;
        e.direction_pdf = cone_pdf(one_minus_cos);
        float falloff = spot ? spot_falloff(local.z, light.cos_inner, light.cos_outer) : 1.0;
        e.power = light.strength * (falloff / (e.direction_pdf * choice.probability));
    }
    return e;
}

#endif
