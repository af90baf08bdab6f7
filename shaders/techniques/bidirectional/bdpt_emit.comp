#version 460
// Light subpaths leave the lights: one slot each. A light is chosen by its power, a point on it evenly, a direction by what it emits there; directional
// lights and the environment send theirs through a disk as large as the scene's bounding sphere. As techniques/photon_mapping/photon_emit.comp, with the partial weights
// that bdpt_mis.glsl goes on from.
//
// Veach 1997, 10; I. Georgiev, "Implementing Vertex Connection and Merging", 2012. Deterministic in (seed, pass, walk).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/bidirectional/bdpt_set.glsl"
#include "walk/wave.glsl"
#include "transport/bodies.glsl"
#include "techniques/bidirectional/bdpt_lights.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    float radius;  // of the scene's bounding sphere
    vec3 scene_upper;
    WalkKey key;   // the sequence is the pass, places in it walks
} push;

#include "walk/draws.glsl"

// Slots of random numbers at emission: those for a walk's start.
const uint DIMENSION_POINT = 0u;    // light, and point of it
const uint DIMENSION_EMITTED = 1u;  // side of the light, and direction

struct Emission {
    vec3 origin;
    vec3 direction;
    vec3 power;  // over the density
    bool infinite;
    PartialWeights weights;
};

vec3 in_frame(vec3 local, vec3 z) {
    vec3 x;
    vec3 y;
    orthonormal_basis(z, x, y);
    return local.x * x + local.y * y + local.z * z;
}

// A beam of parallel light through the disk; `pdf` is the density of its direction, 0 for a light that has but one.
Emission parallel_emission(vec3 direction, vec3 irradiance, float pdf, vec2 u) {
    vec3 middle = 0.5 * (push.scene_lower + push.scene_upper);
    float area = PI * push.radius * push.radius;
    Emission e;
    e.direction = direction;
    e.origin = middle + push.radius * (in_frame(vec3(square_to_disk(u), 0.0), direction) - direction);
    e.power = irradiance * area;
    e.infinite = true;
    e.weights = PartialWeights(area, pdf > 0.0 ? area / pdf : 0.0);
    return e;
}

Emission emit(uint slot) {
    uvec2 point = sampler_bits(walk_sampler(slot, DIMENSION_POINT));
    uvec2 direction = sampler_bits(walk_sampler(slot, DIMENSION_EMITTED));
    uvec3 fresh = pcg3d(uvec3(point.x, direction));
    LightChoice choice = choose_light_by_power(point, fresh.x);
    SceneLight light = choice.light;
    vec2 u = vec2(unit_float(point.x), unit_float(point.y));
    vec2 v = vec2(unit_float(direction.x), unit_float(direction.y));
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment environment = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(environment), 0.0, true, direction, fresh.yz, found);
        float pdf = found.a * choice.probability;
        return parallel_emission(-environment_to_world(environment, local), found.rgb / pdf, pdf, u);
    }
    if (HAS_PUNCTUAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        return parallel_emission(light.direction, light.strength / choice.probability, 0.0, u);
    }
    Emission e;
    e.infinite = false;
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        Surface s = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), push.scene_lower, push.scene_upper);
        SceneMaterial m = load_material(s.material);
        float side = lamp_side_probability(m);
        bool turned = side < 1.0 && choose_first(v.x, side);
        vec3 normal = turned ? -s.geometric_normal : s.geometric_normal;
        vec3 local = square_to_cosine_hemisphere(v);
        e.direction = in_frame(local, normal);
        e.origin = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, e.direction);
        // Over the density of the place and of the direction per projected solid angle.
        float measure = PI * 0.5 * s.double_area / (side * choice.probability);
        e.power = surface_emission(m, s, e.direction) * measure;
        if (HAS_ALPHA) {
            e.power *= material_coverage(m, surface_base_color(m, s).a);
        }
        e.weights = PartialWeights(1.0 / (side * cosine_hemisphere_pdf(max(local.z, MIS_COS_MIN))), measure);
        return e;
    }
    e.origin = light.position;
    // Where no light can be chosen, walks carry nothing, somewhere.
    e.direction = vec3(0.0, 0.0, 1.0);
    e.power = vec3(0.0);
    e.weights = PartialWeights(0.0, 0.0);
    if (HAS_PUNCTUAL_LIGHTS) {
        float one_minus_cos = punctual_one_minus_cos(light);
        vec3 local = square_to_cone(v, one_minus_cos);
        e.direction = light.kind == LIGHT_SPOT ? in_frame(local, light.direction) : local;
        float pdf = cone_pdf(one_minus_cos);
        float falloff = light.kind == LIGHT_SPOT ? spot_falloff(local.z, light.cos_inner, light.cos_outer) : 1.0;
        e.power = light.strength * (falloff / (pdf * choice.probability));
        e.weights = PartialWeights(1.0 / pdf, 0.0);
    }
    return e;
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.key.indices) {
        return;
    }
    Emission e = emit(slot);
    // Walks from the lights have no use for a density: whether they come from infinity stands there.
    walk_states_out[slot] = WalkState(e.origin, 1.0, normalize(e.direction), 0u, e.power, e.infinite ? 1.0 : 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), OUTSIDE);
    subpath_weights[slot] = mis_bounded(e.weights);
}
