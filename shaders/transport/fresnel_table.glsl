// The product of a metal's Fresnel factor and the simplified geometric term over the cosine of microfacet incidence, from a table that the
// host computes.
//
// Layout and source: transport/fresnel/table.rs. Expects `vec4 fresnel_table(uint index)`, declared before the inclusion, which reads it.
#ifndef CLERESTORY_TRANSPORT_FRESNEL_TABLE_GLSL
#define CLERESTORY_TRANSPORT_FRESNEL_TABLE_GLSL

const uint FRESNEL_TABLE_NODES = 256u;
// Binary logarithm of the least cosine: 2^-10.
const float FRESNEL_TABLE_DEPTH = 10.0;

vec3 fresnel_table_lookup(float cos_h) {
    float depth = -log2(clamp(cos_h, exp2(-FRESNEL_TABLE_DEPTH), 1.0));
    float p = (FRESNEL_TABLE_DEPTH - depth) * (float(FRESNEL_TABLE_NODES - 1u) / FRESNEL_TABLE_DEPTH);
    uint i = min(uint(p), FRESNEL_TABLE_NODES - 2u);
    return mix(fresnel_table(i).rgb, fresnel_table(i + 1u).rgb, p - float(i));
}

#endif
