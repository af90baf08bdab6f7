#version 460
// Radiance of points by a lobe about an axis, from the lights of a coarse map; one point an invocation. Sources, bias and guarantees:
// maps/gather/mod.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"

float gather_table_value(uint i);

#include "maps/gather.glsl"

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

// Takes the place of a lesser entry, which it becomes.
void gather_keep(inout vec4 kept, inout vec4 entry) {
    if (entry.w > kept.w) {
        vec4 lesser = kept;
        kept = entry;
        entry = lesser;
    }
}

void main() {
    uint i = invocation_index();
    if (i >= push.count) {
        return;
    }
    GatherPoint point = points[i];
    if (GATHER_FIVE) {
        // Radiance and term, greatest first.
        vec4 a = vec4(0.0), b = vec4(0.0), c = vec4(0.0), d = vec4(0.0), e = vec4(0.0);
        for (uint k = 0u; k < push.lights; ++k) {
            GatherRecord light = gather_lights[k];
            vec4 entry = vec4(light.radiance, gather_term(light, point.position, point.axis, push.exponent, GATHER_CONES));
            gather_keep(a, entry);
            gather_keep(b, entry);
            gather_keep(c, entry);
            gather_keep(d, entry);
            gather_keep(e, entry);
        }
        vec3 sum = a.w * a.rgb + b.w * b.rgb + c.w * c.rgb + d.w * d.rgb + e.w * e.rgb;
        float whole = a.w + b.w + c.w + d.w + e.w;
        values[i] = GATHER_SCALED && whole > 0.0 ? sum / whole : sum;
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
