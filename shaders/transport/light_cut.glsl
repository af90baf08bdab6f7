// A cut through a tree of lights for a point: nodes below which every light is once, those that may send the most split first.
//
// Sources: Walter et al., "Lightcuts" (2005), section 4; Yuksel, "Stochastic Lightcuts" (2019), section 3: a cut of fixed size, below each of whose nodes one light
// is chosen, so that the estimate is unbiased. Twin of transport/light_tree/cut.rs.
// Guarantees: deterministic, of equal nodes the one that came first is split; positive importance wherever a node has lights of positive strength.
// Expects, declared before the inclusion, what light_tree.glsl expects.
#ifndef CLERESTORY_TRANSPORT_LIGHT_CUT_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_CUT_GLSL

#include "transport/light_tree.glsl"

// Nodes of a cut at most.
const uint LIGHT_CUT_MAX = 64u;

// The cut that light_cut made last: nodes, and what they may send; 0 for leaves, which are not split.
uint light_cut_nodes[LIGHT_CUT_MAX];
float light_cut_importances[LIGHT_CUT_MAX];

void place_in_cut(uint place, uint index, vec3 from, vec3 normal) {
    SceneLightNode node = CLERESTORY_LIGHT_NODE(index);
    light_cut_nodes[place] = index;
    light_cut_importances[place] = (node.child & LIGHT_NODE_LEAF) != 0u ? 0.0 : light_node_importance(node, from, normal);
}

// Makes the cut of a point, of `size` nodes or, where there are fewer lights that may send anything, less; the number of its nodes.
uint light_cut(vec3 from, vec3 normal, uint size) {
    place_in_cut(0u, 0u, from, normal);
    uint count = 1u;
    // A node with one child splits into it alone: there are no more such nodes than levels.
    for (uint step = 0u; step < size + LIGHT_TREE_DEPTH_MAX && count < size; ++step) {
        uint strongest = 0u;
        float greatest = 0.0;
        for (uint i = 0u; i < count; ++i) {
            float importance = light_cut_importances[i];
            strongest = importance > greatest ? i : strongest;
            greatest = max(importance, greatest);
        }
        if (greatest <= 0.0) {
            break;
        }
        SceneLightNode node = CLERESTORY_LIGHT_NODE(light_cut_nodes[strongest]);
        place_in_cut(strongest, node.child, from, normal);
        if (node.share < 1.0) {
            place_in_cut(count, node.child + 1u, from, normal);
            ++count;
        }
    }
    return count;
}

// The light below a node of the cut that a word chooses for the point, and its probability among those below it.
uint light_cut_sample(uint place, vec3 from, vec3 normal, uint word, uint fresh, out float probability) {
    SceneLightNode node = CLERESTORY_LIGHT_NODE(light_cut_nodes[place]);
    return light_tree_descend(node.child, node.share, from, normal, word, fresh, probability);
}

#endif
