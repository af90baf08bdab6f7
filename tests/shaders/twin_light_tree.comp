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

// A bound where cuts are compared, else none.
#define CLERESTORY_LIGHT_GEOMETRY_MOST (push.function == 2u ? in1(12u) : 3.402823e38)

#include "techniques/instant_radiosity/potential_bins.glsl"
#include "transport/light_cut.glsl"
#include "transport/light_node.glsl"

// Unions of cones and nodes, and bins of potentials.
void unions() {
    LightCone both = cone_union(LightCone(in3(0u), in1(3u), in1(4u)), LightCone(in3(5u), in1(8u), in1(9u)));
    out3(0u, both.axis);
    out1(3u, both.spread);
    out1(4u, both.reach);
    out_bits(5u, potential_bin(in1(10u)));
    out1(6u, potential_bin_least(in_bits(11u)));
    SceneLightNode node = light_node_union(load_light_node(in_bits(12u)), load_light_node(in_bits(13u)));
    out3(7u, node.center);
    out3(10u, node.half_extent);
    out1(13u, node.strength);
    out1(14u, node.radius);
    out1(15u, node.cos_spread);
}

// The cut of a point, and the light that a word chooses below one of its nodes.
void cut() {
    vec3 from = in3(0u);
    vec3 normal = in3(3u);
    uint count = light_cut(from, normal, in_bits(10u));
    uint place = in_bits(11u) % count;
    float probability;
    out_bits(0u, count);
    out_bits(1u, place);
    out_bits(2u, light_cut_nodes[place]);
    out_bits(3u, light_cut_sample(place, from, normal, in_word(6u), in_word(8u), probability));
    out1(4u, probability);
    uint sum = 0u;
    for (uint i = 0u; i < count; ++i) {
        sum += light_cut_nodes[i];
    }
    out_bits(5u, sum);
}

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    if (push.function == 1u) {
        unions();
        return;
    }
    if (push.function == 2u) {
        cut();
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
