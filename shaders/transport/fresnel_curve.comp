#version 460
// A form of a metal's Fresnel factor over even cosines, or chains of evaluations, for its error and its cost. Host: transport/fresnel/curve.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "transport/fresnel_curve.glsl"

layout(constant_id = 0) const uint CURVE_FORM = CURVE_EXACT;
// Evaluations of an invocation, each at a cosine that follows from the result before.
layout(constant_id = 1) const uint CURVE_CHAIN = 1u;

layout(push_constant, scalar) uniform Push {
    vec3 eta;
    uint count;
    vec3 k;
    vec3 f0;
    vec3 a;
    vec3 alpha;
    vec2 cosines;  // of the first invocation and of the last
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Table { vec4 curve_table[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Values { float curve_values[]; };  // three an invocation

vec4 fresnel_table(uint index) { return curve_table[index]; }

#include "transport/fresnel_forms.glsl"
#include "transport/fresnel_table.glsl"

// Too little to change a number, but enough that nothing of a metal is the same for all evaluations, as where metals change from pixel to pixel.
const float CURVE_DRIFT = 1e-12;
// Turns a result into the next cosine.
const float CURVE_STEP = 0.618034;

vec3 curve_at(float c) {
    vec3 drift = vec3(c * CURVE_DRIFT);
    switch (CURVE_FORM) {
    case CURVE_EXACT:
        return fresnel_conductor(c, push.eta + drift, push.k + drift);
    case CURVE_SCHLICK:
        return fresnel_rescaled(c, push.eta + drift, vec3(0.0));
    case CURVE_RESCALED:
        return fresnel_rescaled(c, push.eta + drift, push.k + drift);
    case CURVE_COMPENSATED: {
        float m = clamp(1.0 - c, 0.0, 1.0);
        return fresnel_rescaled(c, push.eta + drift, push.k + drift) - (push.a + drift) * c * pow(vec3(m), push.alpha + drift);
    }
    case CURVE_RESCALED_F0:
        return fresnel_schlick(c, push.f0 + drift);
    case CURVE_COMPENSATED_F0:
        return fresnel_compensated(c, push.f0 + drift, push.a + drift, push.alpha + drift);
    case CURVE_TINTED:
        return fresnel_tinted(c, push.f0 + drift, push.a + drift);
    case CURVE_SIMPLIFIED:
        return fresnel_simplified(c, push.eta + drift, push.k + drift);
    case CURVE_ARTISTIC: {
        vec3 eta;
        vec3 k;
        artistic_index(push.f0 + drift, push.a + drift, eta, k);
        return fresnel_simplified(c, eta, k);
    }
    case CURVE_TABLE:
        return fresnel_table_lookup(0u, c);
    default:
        return vec3(c) + drift;
    }
}

void main() {
    uint i = invocation_index();
    if (i >= push.count) {
        return;
    }
    float c = push.cosines.x + (push.cosines.y - push.cosines.x) * (float(i) / float(push.count - 1u));
    vec3 value = curve_at(c);
    for (uint j = 1u; j < CURVE_CHAIN; ++j) {
        c = fract(c + CURVE_STEP * (value.x + value.y + value.z));
        value = curve_at(c);
    }
    for (uint band = 0u; band < 3u; ++band) {
        curve_values[3u * i + band] = value[band];
    }
}
