#version 460
// Leaves of the tree over virtual lights, in the order of their codes: place, cone of normals, and the greatest intensity as far as the record tells it.
// CL-VPL-CUTS: D. Lin and C. Yuksel, "Real-Time Stochastic Lightcuts", 2020, section 4.1.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "pi.glsl"
#include "scene/records.glsl"
#include "techniques/instant_radiosity/virtual_light.glsl"
#include "transport/luminance.glsl"

layout(set = 0, binding = 0) uniform utextureBuffer virtual_light_texels;
layout(set = 0, binding = 1) uniform utextureBuffer light_order;  // four words a texel
layout(set = 0, binding = 2, scalar) restrict writeonly buffer LightNodes { SceneLightNode light_nodes[]; };

layout(push_constant, scalar) uniform Push {
    uint first;   // node of the first leaf
    uint lights;
    uint nodes;   // of the tree
} push;

const uint LIGHTS_A_TEXEL = 4u;
// Whether light leaves a surface to the side that it came from alone, about the geometric normal; else to all sides.
const bool STAYS_ON_ITS_SIDE = !HAS_TRANSMISSION && !HAS_SHADING_NORMALS && !HAS_NORMAL_MAPS;

void main() {
    uint leaf = gl_GlobalInvocationID.x;
    if (leaf >= push.lights) {
        return;
    }
    uint number = texelFetch(light_order, int(leaf / LIGHTS_A_TEXEL))[leaf % LIGHTS_A_TEXEL];
    int quarter = int(VIRTUAL_LIGHT_QUARTERS * number);
    VirtualLight light = unpack_virtual_light(texelFetch(virtual_light_texels, quarter), texelFetch(virtual_light_texels, quarter + 1),
                                              texelFetch(virtual_light_texels, quarter + 2), texelFetch(virtual_light_texels, quarter + 3));
    SceneLightNode node;
    node.center = light.position;
    node.strength = INV_PI * dot(LAMBERT ? light.power * light.surface : light.power, LUMINANCE.rgb);
    node.half_extent = vec3(0.0);
    node.radius = 0.0;
    node.axis = light.normal;
    node.cos_spread = STAYS_ON_ITS_SIDE ? 1.0 : -1.0;
    node.cos_reach = 0.0;
    node.share = 0.0;
    node.child = LIGHT_NODE_LEAF | number;
    node.node_count = push.nodes;
    light_nodes[push.first + leaf] = node;
}
