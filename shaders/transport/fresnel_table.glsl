// The product of a metal's Fresnel factor and the simplified geometric term over the cosine of microfacet incidence, from a table that the
// host computes.
//
// Layout and source: transport/fresnel/table.rs. Expects `vec4 fresnel_table(uint index)`, declared before the inclusion, which reads a node; tables follow each other.
#ifndef CLERESTORY_TRANSPORT_FRESNEL_TABLE_GLSL
#define CLERESTORY_TRANSPORT_FRESNEL_TABLE_GLSL

const uint FRESNEL_TABLE_NODES = 256u;
// Binary logarithm of the least cosine: 2^-10.
const float FRESNEL_TABLE_DEPTH = 10.0;

// From the table of a number.
vec3 fresnel_table_lookup(uint table, float cos_h) {
    float depth = -log2(clamp(cos_h, exp2(-FRESNEL_TABLE_DEPTH), 1.0));
    float p = (FRESNEL_TABLE_DEPTH - depth) * (float(FRESNEL_TABLE_NODES - 1u) / FRESNEL_TABLE_DEPTH);
    uint i = min(uint(p), FRESNEL_TABLE_NODES - 2u);
    uint node = FRESNEL_TABLE_NODES * table + i;
    return mix(fresnel_table(node).rgb, fresnel_table(node + 1u).rgb, p - float(i));
}

// The factor itself; below the table's least cosine straight to 1.
vec3 fresnel_tabulated(uint table, float cos_i) {
    float least = exp2(-FRESNEL_TABLE_DEPTH);
    float cosine = clamp(cos_i, least, 1.0);
    vec3 looked_up = fresnel_table_lookup(table, cosine) * (4.0 * cosine * cosine);
    return clamp(mix(vec3(1.0), looked_up, clamp(cos_i / least, 0.0, 1.0)), vec3(0.0), vec3(1.0));
}

#endif
