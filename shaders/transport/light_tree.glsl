// Choice of one light among many for a point that it is to light: down a binary tree of bounds and cones by one random word.
//
// Sources: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting" (HPG 2018), section 4: importance by
// intensity, distance and cones; Walter et al., "Lightcuts" (2005), section 4.1: bounds of cosines over a box; Pharr, Jakob and Humphreys,
// "Physically Based Rendering" (4th edition), 12.6.3: the way to a light in bits. Method and layout: transport/light_tree/mod.rs.
// Guarantees: at every node each child has a probability that is a positive multiple of 2^-24, exactly the share of words that choose it, so
// that no light is lost to rounding; at most LIGHT_TREE_DEPTH_MAX steps.
// Expects, declared before the inclusion: `SceneLightNode load_light_node(uint index)`, `uint load_light_trail(uint light)`, and what
// distribution.glsl expects. Of another tree than the scene's: CLERESTORY_LIGHT_NODE, the name of the function that loads its nodes, and
// CLERESTORY_LIGHT_GEOMETRY_MOST, the greatest geometry term that its lights are taken to have, 1/m2.
#ifndef CLERESTORY_TRANSPORT_LIGHT_TREE_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_TREE_GLSL

#include "scene/records.glsl"
#include "transport/distribution.glsl"

#ifndef CLERESTORY_LIGHT_NODE
#define CLERESTORY_LIGHT_NODE load_light_node
#endif

// Least cosine of a bound: more than what rounding makes of a light just above a horizon, so that no light is without importance. 2^-20.
const float LIGHT_COS_MIN = 9.5367432e-7;
// By how much a cosine may miss the rim of a cone and still count as inside, since sines of small angles have half of the digits. 2^-10.
const float LIGHT_CONE_SLACK = 9.765625e-4;
// Least share of the squared radius of a cluster that counts as its squared distance: about where its nearest light is, seen from among them.
const float LIGHT_NEAREST_SHARE = 0.125;
// Least squared distance, so that importances stay finite where a point light is: 2^-80 m2.
const float LIGHT_SQUARED_MIN = 8.271806e-25;

// Cosine and sine of the difference of two angles in [0, pi] given so; of 0 where the second is greater.
vec2 angle_less(vec2 a, vec2 b) { return a.x >= b.x ? vec2(1.0, 0.0) : vec2(a.x * b.x + a.y * b.y, a.y * b.x - a.x * b.y); }

// Greatest cosine between a direction and the ways to the points of a box: `along` is the greatest dot product, `least` and `greatest` are
// the distances.
float cosine_bound(float along, float least, float greatest) {
    return clamp(along / max(along > 0.0 ? least : greatest, LIGHT_SQUARED_MIN), -1.0, 1.0);
}

// What the lights of a node may send to a point, relative to the strongest, 1/m2: intensity, over the square of a distance between that of their box and that of its
// middle, times the greatest cosines at the lights and at the point. A `normal` of zero stands for points that scatter from all sides.
float light_node_importance(SceneLightNode n, vec3 from, vec3 normal) {
    vec3 to = n.center - from;
    vec3 outside = max(abs(to) - n.half_extent, 0.0);
    float least = length(outside);
    float greatest = length(abs(to) + n.half_extent);
    float middle = max(length(to), n.radius);
    float squared = max(max(least * middle, LIGHT_NEAREST_SHARE * n.radius * n.radius), LIGHT_SQUARED_MIN);
    float importance = n.strength / squared;
    if (least > 0.0) {
        float seen = cosine_bound(dot(abs(n.axis), n.half_extent) - dot(n.axis, to), least, greatest);
        float beyond = angle_less(vec2(seen, sqrt(max(1.0 - seen * seen, 0.0))),
                                  vec2(n.cos_spread, sqrt(max(1.0 - n.cos_spread * n.cos_spread, 0.0)))).x;
        importance *= beyond < n.cos_reach - LIGHT_CONE_SLACK ? LIGHT_COS_MIN : max(beyond, LIGHT_COS_MIN);
        if (normal != vec3(0.0)) {
            importance *= max(cosine_bound(dot(normal, to) + dot(abs(normal), n.half_extent), least, greatest), LIGHT_COS_MIN);
        }
    }
#ifdef CLERESTORY_LIGHT_GEOMETRY_MOST
    importance = min(importance, n.strength * CLERESTORY_LIGHT_GEOMETRY_MOST);
#endif
    return importance;
}

// Probability of the first of two children: `share` where it is fixed, by importance where that is zero.
float light_node_share(SceneLightNode first, SceneLightNode second, float share, vec3 from, vec3 normal) {
    if (share > 0.0) {
        return share;
    }
    float a = light_node_importance(first, from, normal);
    float both = a + light_node_importance(second, from, normal);
    float p = both > 0.0 ? a / both : 0.5;
    return clamp(floor(p * DISTRIBUTION_QUANTA + 0.5), 1.0, DISTRIBUTION_QUANTA - 1.0) / DISTRIBUTION_QUANTA;
}

// The light below a node, whose first child and fixed share these are, that a word chooses for a point. The word becomes its place within that
// light's share.
uint light_tree_descend(uint child, float share, vec3 from, vec3 normal, inout uint word, uint fresh, out float probability) {
    probability = 1.0;
    for (uint depth = 0u; depth < LIGHT_TREE_DEPTH_MAX && (child & LIGHT_NODE_LEAF) == 0u; ++depth) {
        SceneLightNode first = CLERESTORY_LIGHT_NODE(child);
        SceneLightNode second = CLERESTORY_LIGHT_NODE(child + 1u);
        float p = light_node_share(first, second, share, from, normal);
        bool goes_first = unit_float(word) < p;
        float chosen = goes_first ? p : 1.0 - p;
        // Each level makes up for its own bits.
        fresh = pcg3d(uvec3(fresh, child, depth)).x;
        word = rescaled_word(word, goes_first ? 0.0 : p, chosen, fresh);
        probability *= chosen;
        share = goes_first ? first.share : second.share;
        child = goes_first ? first.child : second.child;
    }
    return child & ~LIGHT_NODE_LEAF;
}

// The light that a word chooses for a point. The word becomes its place within that light's share.
uint light_tree_sample(vec3 from, vec3 normal, inout uint word, uint fresh, out float probability) {
    SceneLightNode root = CLERESTORY_LIGHT_NODE(0u);
    return light_tree_descend(root.child, root.share, from, normal, word, fresh, probability);
}

// Probability with which light_tree_sample chooses a light for a point, by the way to it; 0 for lights that are not in the tree.
float light_tree_probability(uint light, vec3 from, vec3 normal) {
    uint trail = load_light_trail(light);
    if (trail == LIGHT_TRAIL_NONE) {
        return 0.0;
    }
    SceneLightNode root = CLERESTORY_LIGHT_NODE(0u);
    uint child = root.child;
    float share = root.share;
    float probability = 1.0;
    for (uint depth = 0u; depth < LIGHT_TREE_DEPTH_MAX && (child & LIGHT_NODE_LEAF) == 0u; ++depth) {
        SceneLightNode first = CLERESTORY_LIGHT_NODE(child);
        SceneLightNode second = CLERESTORY_LIGHT_NODE(child + 1u);
        float p = light_node_share(first, second, share, from, normal);
        bool goes_first = (trail >> depth & 1u) == 0u;
        probability *= goes_first ? p : 1.0 - p;
        share = goes_first ? first.share : second.share;
        child = goes_first ? first.child : second.child;
    }
    return probability;
}

#endif
