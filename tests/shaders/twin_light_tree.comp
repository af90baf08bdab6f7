#version 460
// The functions of the tree of lights, for comparison with their Rust twins.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

#define CLERESTORY_SAMPLER 1u

float distribution_cdf(uint index) { return 0.0; }
// A word travels as two halves, as in twin_tables.comp.
uint in_word(uint i) { return uint(in1(i)) << 16u | uint(in1(i + 1u)); }

#include "scene/records.glsl"

vec4 quarter(uint index) {
    return vec4(twin_table[4u * index], twin_table[4u * index + 1u], twin_table[4u * index + 2u], twin_table[4u * index + 3u]);
}
// Words that are no numbers travel as such: children, leaves as -1 - light, and trails, -1 for none.
SceneLightNode load_light_node(uint index) {
    uint first = LIGHT_NODE_QUARTERS * index;
    vec4 q0 = quarter(first);
    vec4 q1 = quarter(first + 1u);
    vec4 q2 = quarter(first + 2u);
    vec4 q3 = quarter(first + 3u);
    uint child = q3.z < 0.0 ? LIGHT_NODE_LEAF | uint(-1.0 - q3.z) : uint(q3.z);
    return SceneLightNode(q0.xyz, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, q3.x, q3.y, child, uint(q3.w));
}
uint load_light_trail(uint light) {
    float trail = twin_table[4u * LIGHT_NODE_QUARTERS * uint(twin_table[4u * LIGHT_NODE_QUARTERS - 1u]) + light];
    return trail < 0.0 ? LIGHT_TRAIL_NONE : uint(trail);
}

#include "transport/light_tree.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    vec3 from = in3(0u);
    vec3 normal = in3(3u);
    SceneLightNode node = load_light_node(in_bits(11u));
    float probability;
    uint word = in_word(6u);
    out1(0u, light_node_importance(node, from, normal));
    out1(1u, (node.child & LIGHT_NODE_LEAF) != 0u ? 0.0
                 : light_node_share(load_light_node(node.child), load_light_node(node.child + 1u), node.share, from, normal));
    out1(2u, light_tree_probability(in_bits(10u), from, normal));
    uint light = light_tree_sample(from, normal, word, in_word(8u), probability);
    out_bits(3u, light);
    out1(4u, probability);
    out1(5u, light_tree_probability(light, from, normal));
    out1(6u, unit_float(word));
}
