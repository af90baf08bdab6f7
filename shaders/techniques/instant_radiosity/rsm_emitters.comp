#version 460
// What reflective shadow maps are drawn from: all lights, where they are few and none has an area, or primary virtual lights that are chosen by power, a point each of
// lights with an area, a direction each of the environment.
//
// SVO-P8; A. Keller, "Instant Radiosity", 1997 (primary virtual lights). Deterministic in (seed, frame, emitter).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(constant_id = 40) const bool CHOOSES = true;  // else the first lights are the emitters

#include "transport/features.glsl"
#include "invocation.glsl"
#include "techniques/instant_radiosity/rsm.glsl"
#include "transport/light_choice.glsl"
#include "transport/random.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint emitters;
    vec3 scene_upper;
    uint frame;
    uint seed;
} push;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer RsmEmitters { RsmEmitter rsm_emitters[]; };

RsmEmitter emitter_of(SceneLight light, float probability, uvec2 point, uvec2 fresh) {
    RsmEmitter e = RsmEmitter(light.position, RSM_POINT, light.direction, light.cos_outer, light.strength / probability, light.cos_inner);
    if (HAS_ENVIRONMENT && light.kind == LIGHT_ENVIRONMENT) {
        vec4 found;
        SceneEnvironment environment = load_environment();
        vec3 local = environment_sample(environment_cdf_base(), environment_size(environment), 0.0, true, point, fresh, found);
        e.kind = RSM_DISTANT;
        e.direction = -environment_to_world(environment, local);
        e.strength = found.rgb / (found.a * probability);
    } else if (HAS_AREA_LIGHTS && light.kind == LIGHT_TRIANGLE) {
        vec2 u = vec2(unit_float(point.x), unit_float(point.y));
        Surface s = surface_at(Hit(0.0, square_to_triangle(u).yz, light.triangle), push.scene_lower, push.scene_upper);
        SceneMaterial m = load_material(s.material);
        bool both_sides = (m.flags & MATERIAL_DOUBLE_SIDED) != 0u;
        bool turned = both_sides && fresh.x >> 31u != 0u;
        e.kind = RSM_SURFACE;
        e.direction = turned ? -s.geometric_normal : s.geometric_normal;
        e.position = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, e.direction);
        float area = (both_sides ? 1.0 : 0.5) * s.double_area;
        e.strength = surface_emission(m, s, e.direction) * (area / probability);
        if (HAS_ALPHA) {
            e.strength *= material_coverage(m, surface_base_color(m, s).a);
        }
    } else if (HAS_PUNCTUAL_LIGHTS) {
        e.kind = light.kind == LIGHT_DIRECTIONAL ? RSM_DISTANT : light.kind == LIGHT_SPOT ? RSM_SPOT : RSM_POINT;
    }
    return e;
}

void main() {
    uint number = invocation_index();
    if (number >= push.emitters) {
        return;
    }
    float probability = 1.0;
    uint index = number;
    uvec2 point = uvec2(0u);
    uvec2 fresh = uvec2(0u);
    if (CHOOSES) {
        Sampler numbers = Sampler(0u, push.frame * push.emitters + number, 0u, push.seed);
        point = sampler_bits(numbers);
        numbers.dimension = 1u;
        fresh = sampler_bits(numbers);
        uvec3 other = pcg3d(uvec3(point.x, fresh));
        index = distribution_sample(0u, light_count(), point.x, other.x, probability);
        probability *= float(push.emitters);
    }
    rsm_emitters[number] = emitter_of(load_light(index), probability, point, fresh);
}
