#version 460
// A level of the tree over virtual lights, above one that is there: each node around its two children, or around one at the end of the level.
//
// The tree is perfect but for its end: of each level the nodes lie side by side behind those of the levels above, and a node's children beside each other.
// CL-VPL-CUTS: D. Lin and C. Yuksel, "Real-Time Stochastic Lightcuts", 2020, section 4.1.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/light_node.glsl"

layout(set = 0, binding = 0, scalar) restrict buffer LightNodes { SceneLightNode light_nodes[]; };

layout(push_constant, scalar) uniform Push {
    uint first;     // node of the level
    uint count;     // of the level
    uint children;  // nodes of the level below
} push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place < push.count) {
        uint child = push.first + place + push.first + place + 1u;
        bool has_both = 2u * place + 1u < push.children;
        SceneLightNode first = light_nodes[child];
        SceneLightNode node = light_node_union(first, light_nodes[has_both ? child + 1u : child]);
        // A child that is alone has been joined with itself.
        node.strength = has_both ? node.strength : first.strength;
        node.share = has_both ? 0.0 : 1.0;
        node.child = child;
        light_nodes[push.first + place] = node;
    }
}
