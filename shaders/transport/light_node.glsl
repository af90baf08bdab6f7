// A node of a tree of lights around two others. Source and meaning: transport/light_tree/cut.rs, whose twin this is.
#ifndef CLERESTORY_TRANSPORT_LIGHT_NODE_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_NODE_GLSL

#include "scene/records.glsl"
#include "transport/light_cone.glsl"

LightCone light_node_cone(SceneLightNode n) { return LightCone(n.axis, acos(clamp(n.cos_spread, -1.0, 1.0)), acos(clamp(n.cos_reach, -1.0, 1.0))); }

// What is around both, without children or shares.
SceneLightNode light_node_union(SceneLightNode a, SceneLightNode b) {
    vec3 lower = min(a.center - a.half_extent, b.center - b.half_extent);
    vec3 upper = max(a.center + a.half_extent, b.center + b.half_extent);
    LightCone cone = cone_union(light_node_cone(a), light_node_cone(b));
    SceneLightNode n;
    n.center = 0.5 * (lower + upper);
    n.strength = a.strength + b.strength;
    n.half_extent = max(upper - n.center, n.center - lower);
    n.radius = length(n.half_extent);
    n.axis = cone.axis;
    n.cos_spread = cos(cone.spread);
    n.cos_reach = min(a.cos_reach, b.cos_reach);
    n.share = 0.0;
    n.child = 0u;
    n.node_count = 0u;
    return n;
}

#endif
