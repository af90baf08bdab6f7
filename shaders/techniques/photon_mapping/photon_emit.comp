#version 460
// Photons leave the lights: one slot each. A light is chosen by its power, a point on it evenly, a direction by what it emits there, so that
// photons of one light carry about the same flux. Directional lights and the environment send theirs through a disk as large as the
// scene's bounding sphere.
//
// PM-PH-1, PM-PD-1: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §3.4.1 and §5.1.1; area lights and the environment as in Jensen 2001, §5.1.
// Deterministic in (seed, pass, photon).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "techniques/photon_mapping/photon_features.glsl"
#include "techniques/photon_mapping/photon_wave.glsl"
#include "transport/bodies.glsl"
#include "transport/light_choice.glsl"
#include "transport/path_set.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    float radius;  // of the scene's bounding sphere
    vec3 scene_upper;
    WalkKey key;   // the sequence is the pass, places in it photons
    uint photons;  // of the pass
} push;

#include "walk/draws.glsl"

struct Emission {
    vec3 origin;
    vec3 direction;
    vec3 flux;  // over the density
    Differentials differentials;
};

uvec2 emission_words(uint slot, uint dimension) { return sampler_bits(walk_sampler(slot, dimension)); }

vec3 in_frame(vec3 local, vec3 z) {
    vec3 x;
    vec3 y;
    orthonormal_basis(z, x, y);
    return local.x * x + local.y * y + local.z * z;
}

// A beam of parallel light through the disk that the scene's bounding sphere shows to it.
Emission parallel_emission(vec3 direction, vec3 irradiance, vec2 u) {
    vec3 middle = 0.5 * (push.scene_lower + push.scene_upper);
    Emission e;
    e.direction = direction;
    e.origin = middle + push.radius * (in_frame(vec3(square_to_disk(u), 0.0), direction) - direction);
    float area = PI * push.radius * push.radius;
    e.flux = irradiance * area;
    if (HAS_DIFFERENTIALS) {
        e.differentials = parallel_beam_differentials(direction, 1.0 / area);
    }
    return e;
}

// `probability` is that of the light.
Emission emit(uint slot, out float probability) {
    uvec2 point = emission_words(slot, PHOTON_DIMENSION_POINT);
    uvec2 direction = emission_words(slot, PHOTON_DIMENSION_DIRECTION);
    uvec3 fresh = pcg3d(uvec3(point.x, direction));
    SceneLight light = load_light(distribution_sample(0u, light_count(), point.x, fresh.x, probability));
    vec2 u = vec2(unit_float(point.x), unit_float(point.y));
    vec2 v = vec2(unit_float(direction.x), unit_float(direction.y));
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment environment = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(environment), 0.0, true, direction, fresh.yz, found);
        return parallel_emission(-environment_to_world(environment, local), found.rgb / (found.a * probability), u);
    }
    if (HAS_PUNCTUAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        return parallel_emission(light.direction, light.strength / probability, u);
    }
    Emission e;
    // Where no light can be chosen, photons carry nothing, somewhere.
    e.direction = vec3(0.0, 0.0, 1.0);
    e.differentials = Differentials(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        Surface s = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), push.scene_lower, push.scene_upper);
        SceneMaterial m = load_material(s.material);
        bool both_sides = (m.flags & MATERIAL_DOUBLE_SIDED) != 0u;
        bool turned = both_sides && choose_first(v.x, 0.5);
        vec3 normal = turned ? -s.geometric_normal : s.geometric_normal;
        vec3 local = square_to_cosine_hemisphere(v);
        e.direction = in_frame(local, normal);
        e.origin = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, e.direction);
        float area = (both_sides ? 1.0 : 0.5) * s.double_area;
        e.flux = surface_emission(m, s, e.direction) * (PI * area / probability);
        if (HAS_ALPHA) {
            e.flux *= material_coverage(m, surface_base_color(m, s).a);
        }
        if (HAS_DIFFERENTIALS) {
            e.differentials = area_light_differentials(e.direction, cosine_hemisphere_pdf(local.z), 1.0 / area, 2.0 * PI);
        }
        return e;
    }
    e.origin = light.position;
    e.flux = vec3(0.0);
    if (HAS_PUNCTUAL_LIGHTS) {
        bool spot = light.kind == LIGHT_SPOT;
        float one_minus_cos = spot ? 1.0 - light.cos_outer : 2.0;
        vec3 local = square_to_cone(v, one_minus_cos);
        e.direction = spot ? in_frame(local, light.direction) : local;
        float pdf = cone_pdf(one_minus_cos);
        float falloff = spot ? spot_falloff(local.z, light.cos_inner, light.cos_outer) : 1.0;
        e.flux = light.strength * (falloff / (pdf * probability));
        if (HAS_DIFFERENTIALS) {
            e.differentials = emission_differentials(e.direction, pdf);
        }
    }
    return e;
}

// The photon's number among those of its pass that are evenly spread, all by the same offset.
float even_survival(uint slot) {
    uint offset = pcg4d(uvec4(walk_sequence(slot), push.photons, SEQUENCE_KEY, push.key.seed)).x;
    return (float(walk_index(slot)) + unit_float(offset)) / float(push.photons);
}

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.key.indices) {
        return;
    }
    float probability;
    Emission e = emit(slot, probability);
    uint bounce = path_set_joined(0u, PHOTON_UNDIFFUSED);
    float survival = EVEN_SURVIVAL ? even_survival(slot) : 1.0;
    walk_states_out[slot] = WalkState(e.origin, survival, normalize(e.direction), bounce, e.flux, 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), OUTSIDE);
    if (HAS_DIFFERENTIALS) {
        // Only so many photons are of this light.
        photon_differentials[slot] = roulette_differentials(e.differentials, probability);
    }
}
