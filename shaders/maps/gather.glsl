// Lights of a coarse map, and their solid angles seen from elsewhere. Sources, bias and guarantees: maps/gather/mod.rs. Expects
// `float gather_table_value(uint)`.
#ifndef CLERESTORY_MAPS_GATHER_GLSL
#define CLERESTORY_MAPS_GATHER_GLSL

#include "maps/gather_disc.glsl"
#include "maps/packed_direction.glsl"
#include "pi.glsl"

// Forms of solid angles.
const uint GATHER_RATIO = 0u;
const uint GATHER_DISC = 1u;
const uint GATHER_NORMALS = 2u;
// Lights that are summed by themselves, so that small terms meet small sums.
const uint GATHER_BLOCK = 64u;

layout(constant_id = 140) const uint GATHER_FORM = GATHER_DISC;
// The five greatest terms alone (maps/gather_few.glsl), and whether they are scaled to the whole.
layout(constant_id = 141) const bool GATHER_FIVE = false;
layout(constant_id = 142) const bool GATHER_SCALED = true;
// Reflectivities as means over cones, from the table.
layout(constant_id = 143) const bool GATHER_CONES = false;

// A light: position from the map's place, what is divided by the squared distance, mean radiance, packed normal.
struct GatherRecord {
    vec3 position;
    float area;
    vec3 radiance;
    uint normal;
};

// Of a light at a point; `cosine` is that of the surface's normal with the direction to the point.
float gather_solid_angle(float area, float squared, float cosine) {
    float ratio = area / squared;
    if (GATHER_FORM == GATHER_RATIO) {
        return ratio;
    }
    if (GATHER_FORM == GATHER_NORMALS) {
        return cosine > 0.0 ? gather_disc(ratio * cosine) : 0.0;
    }
    return gather_disc(ratio);
}

// Reflectivity times solid angle of a light at x, by a lobe of that exponent about an axis; as its mean over the light's cone, from the table, or at its middle.
float gather_term(GatherRecord light, vec3 x, vec3 axis, float exponent, bool by_cones) {
    vec3 v = light.position - x;
    float squared = dot(v, v);
    if (!(squared > 0.0)) {
        return 0.0;
    }
    vec3 direction = v * inversesqrt(squared);
    float to_point = 1.0;
    if (GATHER_FORM == GATHER_NORMALS) {
        to_point = -dot(unpack_octahedral(light.normal, PACKED_NORMAL_BITS), direction);
    }
    float angle = gather_solid_angle(light.area, squared, to_point);
    float cosine = dot(axis, direction);
    float reflectivity;
    if (by_cones) {
        reflectivity = gather_reflectivity(1.0 - angle / (2.0 * PI), cosine);
    } else {
        // pow of 0 is 0 for these exponents, but not by Vulkan's rules.
        float c = max(cosine, 0.0);
        reflectivity = (exponent + 1.0) / (2.0 * PI) * (exponent == 1.0 ? c : c > 0.0 ? pow(c, exponent) : 0.0);
    }
    return reflectivity * angle;
}

#endif
