#version 460
// Radiance of points by a lobe about an axis, from the lights of a coarse map; one point an invocation. Sources, bias and guarantees:
// maps/gather/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"

float gather_table_value(uint i);

#include "maps/gather.glsl"
#include "maps/gather_few.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
    uint lights;
    float exponent;  // of the lobe
} push;

// From the map's place, and the lobe's unit axis.
struct GatherPoint {
    vec3 position;
    vec3 axis;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer GatherLights { GatherRecord gather_lights[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer GatherTable { float gather_table[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer Points { GatherPoint points[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer Values { vec3 values[]; };

float gather_table_value(uint i) { return gather_table[i]; }

void main() {
    uint i = invocation_index();
    if (i >= push.count) {
        return;
    }
    GatherPoint point = points[i];
    if (GATHER_FIVE) {
        GatherFew few = gather_no_terms();
        for (uint k = 0u; k < push.lights; ++k) {
            GatherRecord light = gather_lights[k];
            float term = gather_term(light, point.position, point.axis, push.exponent, GATHER_CONES);
            gather_add(few, vec4(light.radiance, term));
        }
        vec4 sum = gather_sum(few);
        values[i] = GATHER_SCALED && sum.w > 0.0 ? sum.rgb / sum.w : sum.rgb;
        return;
    }
    vec3 sum = vec3(0.0);
    for (uint first = 0u; first < push.lights; first += GATHER_BLOCK) {
        vec3 block = vec3(0.0);
        for (uint k = first; k < min(first + GATHER_BLOCK, push.lights); ++k) {
            GatherRecord light = gather_lights[k];
            block += gather_term(light, point.position, point.axis, push.exponent, GATHER_CONES) * light.radiance;
        }
        sum += block;
    }
    values[i] = sum;
}
