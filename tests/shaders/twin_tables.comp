#version 460
// Shader functions that read tables, for comparison with their Rust twins: `function` says which.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "twin_interface.glsl"

const bool SEPARABLE_MASKING = false;

#define CLERESTORY_SAMPLER 1u

float distribution_cdf(uint index) { return twin_table[index]; }
vec4 environment_texel(uint index) {
    return vec4(twin_table[4u * index], twin_table[4u * index + 1u], twin_table[4u * index + 2u], twin_table[4u * index + 3u]);
}
float albedo_table(uint index) { return twin_table[index]; }

// A word travels as two halves: its bits must not pass through floating-point registers that could quieten a NaN.
uint in_word(uint i) { return uint(in1(i)) << 16u | uint(in1(i + 1u)); }

#include "scene/records.glsl"
#include "transport/albedo.glsl"
#include "transport/environment.glsl"

// Nodes are quarters as texels are. Words that are no numbers travel as such: children, leaves as -1 - light, and trails, -1 for none.
SceneLightNode load_light_node(uint index) {
    uint first = LIGHT_NODE_QUARTERS * index;
    vec4 q0 = environment_texel(first);
    vec4 q1 = environment_texel(first + 1u);
    vec4 q2 = environment_texel(first + 2u);
    vec4 q3 = environment_texel(first + 3u);
    uint child = q3.z < 0.0 ? LIGHT_NODE_LEAF | uint(-1.0 - q3.z) : uint(q3.z);
    return SceneLightNode(q0.xyz, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, q3.x, q3.y, child, uint(q3.w));
}
uint load_light_trail(uint light) {
    float trail = twin_table[16u * uint(twin_table[15]) + light];
    return trail < 0.0 ? LIGHT_TRAIL_NONE : uint(trail);
}

#include "transport/light_tree.glsl"

void main() {
    if (twin_case() >= push.case_count) {
        return;
    }
    switch (push.function) {
    case 0u: {  // albedos
        float weight;
        uint layer = albedo_layer(in1(3u), weight);
        out1(0u, albedo_lookup(in_bits(0u), in1(1u), in1(2u)));
        out1(1u, albedo_average(in_bits(0u), in1(2u)));
        out1(2u, float(layer) + weight);
        break;
    }
    case 1u: {  // choice among entries
        float probability;
        uint word = in_word(1u);
        out_bits(0u, distribution_sample(0u, in_bits(0u), word, in_word(3u), probability));
        out1(1u, probability);
        out1(2u, unit_float(word));
        break;
    }
    case 2u: {  // environment maps, whose texels stand first
        uvec2 size = uvec2(in_bits(0u), in_bits(1u));
        uint base = 4u * size.x * (size.y + 1u);
        vec4 found;
        bool emission = in_bits(16u) != 0u;
        out3(0u, environment_sample(base, size, in1(15u), emission, uvec2(in_word(2u), in_word(4u)), uvec2(in_word(6u), in_word(8u)), found));
        out3(3u, found.rgb);
        out1(6u, found.a);
        vec4 seen = environment_look_up(size, in1(15u), in3(10u));
        out3(7u, seen.rgb);
        out1(10u, seen.a);
        out2(11u, environment_uv(in3(10u)));
        out3(13u, environment_direction(in2(13u)));
        break;
    }
    case 3u: {  // numbers that are used again, linear densities
        float u = in1(0u);
        out1(0u, choose_first(u, in1(1u)) ? 1.0 : 0.0);
        out1(1u, u);
        out1(2u, linear_sample(in1(0u), in1(2u), in1(3u)));
        break;
    }
    case 4u: {  // choice among lights
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
        break;
    }
    }
}
