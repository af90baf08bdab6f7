// Directional albedos of the GGX reflection lobe, from the table that the host computes.
//
// Method and layout: transport/albedo.rs. Guarantee: averages are those of the interpolated rows.
// Expects: `float albedo_table(uint index)`, declared before the inclusion, which reads the table; what ggx.glsl expects.
#ifndef CLERESTORY_TRANSPORT_ALBEDO_GLSL
#define CLERESTORY_TRANSPORT_ALBEDO_GLSL

#include "transport/ggx.glsl"

const uint COS_NODES = 48u;
const uint ALPHA_NODES = 32u;
// ALPHA_MIN to the power 1/4.
const float ALPHA_ROOT_MIN = 0.1778279410038923;
const uint ETA_NODES = 8u;
const float ETA_PARAMETER_MAX = 0.5;
const uint SCHLICK_LAYER = ETA_NODES + 1u;
const uint AVERAGE_BASE = (ETA_NODES + 2u) * ALPHA_NODES * COS_NODES;

// The lower node and the weight of the upper.
uint albedo_node(float x, uint count, out float t) {
    float p = clamp(x, 0.0, 1.0) * float(count - 1u);
    uint i = min(uint(p), count - 2u);
    t = p - float(i);
    return i;
}

// Row below alpha and the weight of the next: row 0 is the mirror.
uint alpha_node(float alpha, out float t) {
    t = 0.0;
    return alpha < ALPHA_MIN
        ? 0u
        : 1u + albedo_node((sqrt(sqrt(alpha)) - ALPHA_ROOT_MIN) / (1.0 - ALPHA_ROOT_MIN), ALPHA_NODES - 1u, t);
}

float albedo_lookup(uint layer, float cos_theta, float alpha) {
    float fr;
    float fc;
    uint row = alpha_node(alpha, fr);
    uint column = albedo_node(sqrt(sqrt(max(cos_theta, 0.0))), COS_NODES, fc);
    uint i = (layer * ALPHA_NODES + row) * COS_NODES + column;
    return mix(mix(albedo_table(i), albedo_table(i + 1u), fc),
               mix(albedo_table(i + COS_NODES), albedo_table(i + COS_NODES + 1u), fc), fr);
}

float albedo_average(uint layer, float alpha) {
    float fr;
    uint i = AVERAGE_BASE + layer * ALPHA_NODES + alpha_node(alpha, fr);
    return mix(albedo_table(i), albedo_table(i + 1u), fr);
}

// Layer and weight of the next one for a dielectric of index eta; eta <= 0 stands for Schlick's weight.
uint albedo_layer(float eta, out float t) {
    if (eta <= 0.0) {
        t = 1.0;
        return SCHLICK_LAYER - 1u;
    }
    return 1u + albedo_node((eta - 1.0) / (eta + 1.0) / ETA_PARAMETER_MAX, ETA_NODES, t);
}

#endif
