// The scene on the device: set 2, filled by clerestory::transport::GpuScene. What a scene lacks is a buffer of one texel that no
// specialized kernel reads. Triangles are in world space and keep their order in the scene.
//
// Everything is read by texel fetches, which software drivers gather for all lanes at once, where they load storage buffers lane by lane and
// word by word. Records are in quarters (four words); the load functions name their fields, and scene/records.comp tells the host.
#ifndef CLERESTORY_SCENE_BINDINGS_GLSL
#define CLERESTORY_SCENE_BINDINGS_GLSL

#extension GL_EXT_samplerless_texture_functions : require

#include "scene/records.glsl"

// descriptor set 2: SceneSet

layout(set = 2, binding = 0) uniform utextureBuffer scene_triangles;
layout(set = 2, binding = 1) uniform utextureBuffer scene_vertices;  // by triangle: its vertices' places in the attributes
layout(set = 2, binding = 2) uniform textureBuffer scene_normals;    // by vertex: xyz
layout(set = 2, binding = 3) uniform textureBuffer scene_uvs;        // set 0, set 1
layout(set = 2, binding = 4) uniform textureBuffer scene_tangents;
layout(set = 2, binding = 5) uniform textureBuffer scene_colors;
layout(set = 2, binding = 6) uniform utextureBuffer scene_materials;
layout(set = 2, binding = 7) uniform utextureBuffer scene_textures;
layout(set = 2, binding = 8) uniform utextureBuffer scene_texels;    // RGBA8
layout(set = 2, binding = 9) uniform utextureBuffer scene_lights;
// Cumulative probabilities: of the lights, then (from environment_cdf_base on) of the environment's cells.
layout(set = 2, binding = 10) uniform textureBuffer scene_cdf;
// ENVIRONMENT_HEADER_QUARTERS, then by texel RGB radiance and what the luminances at the corners of a cell are multiplied by for the density
// of light sampling per solid angle; the last row is there twice (transport/environment.glsl).
layout(set = 2, binding = 11) uniform utextureBuffer scene_environment;
layout(set = 2, binding = 12) uniform textureBuffer scene_albedo_table;
// The tree of lights, where a kernel chooses by one: its nodes, the first of which is the root, then by light its trail, four in a quarter.
layout(set = 2, binding = 13) uniform utextureBuffer scene_light_tree;

float distribution_cdf(uint index) { return texelFetch(scene_cdf, int(index)).x; }
vec4 environment_texel(uint index) {
    return uintBitsToFloat(texelFetch(scene_environment, int(ENVIRONMENT_HEADER_QUARTERS + index)));
}
float albedo_table(uint index) { return texelFetch(scene_albedo_table, int(index)).x; }

uvec4 material_quarter(uint material, uint quarter) { return texelFetch(scene_materials, int(MATERIAL_QUARTERS * material + quarter)); }

uint light_count() { return uint(textureSize(scene_lights)) / LIGHT_QUARTERS; }

// Where the table of the environment's cells begins, behind that of the lights.
uint environment_cdf_base() { return light_count() + 1u; }

SceneTriangle load_triangle(uint index) {
    int first = int(TRIANGLE_QUARTERS * index);
    uvec4 q0 = texelFetch(scene_triangles, first);
    uvec4 q1 = texelFetch(scene_triangles, first + 1);
    uvec4 q2 = texelFetch(scene_triangles, first + 2);
    return SceneTriangle(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), q2.w);
}

// Vertices of a triangle, for its attributes.
uvec3 load_vertices(uint index) { return texelFetch(scene_vertices, int(index)).xyz; }

SceneMaterial load_material(uint index) {
    vec4 f0 = uintBitsToFloat(material_quarter(index, 0u));
    vec4 f1 = uintBitsToFloat(material_quarter(index, 1u));
    vec4 f2 = uintBitsToFloat(material_quarter(index, 2u));
    vec4 f3 = uintBitsToFloat(material_quarter(index, 3u));
    vec4 f4 = uintBitsToFloat(material_quarter(index, 4u));
    vec4 f5 = uintBitsToFloat(material_quarter(index, 5u));
    vec4 f6 = uintBitsToFloat(material_quarter(index, 6u));
    uvec4 q7 = material_quarter(index, 7u);
    uvec4 q8 = material_quarter(index, 8u);
    uvec4 q9 = material_quarter(index, 9u);
    return SceneMaterial(f0.xyz, f0.w, f1.xyz, f1.w, f2.xyz, f2.w, f3.xyz, f3.w, f4.xyz, f4.w, f5.xyz, f5.w, f6.xyz, f6.w,
                         uintBitsToFloat(q7.x), uintBitsToFloat(q7.y), q7.z, q7.w, q8.x, q8.y, q8.z, q8.w, q9.x, q9.y, q9.z, q9.w);
}

SceneTexture load_texture(uint index) {
    int first = int(TEXTURE_QUARTERS * index);
    uvec4 q0 = texelFetch(scene_textures, first);
    uvec4 q1 = texelFetch(scene_textures, first + 1);
    uvec4 q2 = texelFetch(scene_textures, first + 2);
    return SceneTexture(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, q2.x, q2.yzw);
}

SceneLight load_light(uint index) {
    int first = int(LIGHT_QUARTERS * index);
    uvec4 q0 = texelFetch(scene_lights, first);
    vec4 q1 = uintBitsToFloat(texelFetch(scene_lights, first + 1));
    vec4 q2 = uintBitsToFloat(texelFetch(scene_lights, first + 2));
    vec4 q3 = uintBitsToFloat(texelFetch(scene_lights, first + 3));
    return SceneLight(q0.x, q0.y, q0.zw, q1.xyz, q1.w, q2.xyz, q2.w, q3.xyz, q3.w);
}

SceneLightNode load_light_node(uint index) {
    int first = int(LIGHT_NODE_QUARTERS * index);
    vec4 q0 = uintBitsToFloat(texelFetch(scene_light_tree, first));
    vec4 q1 = uintBitsToFloat(texelFetch(scene_light_tree, first + 1));
    vec4 q2 = uintBitsToFloat(texelFetch(scene_light_tree, first + 2));
    uvec4 q3 = texelFetch(scene_light_tree, first + 3);
    return SceneLightNode(q0.xyz, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, uintBitsToFloat(q3.x), uintBitsToFloat(q3.y), q3.z, q3.w);
}

// The way from the root to a light: a bit a step, the first step last, set where it goes to the second child.
uint load_light_trail(uint light) {
    uint nodes = texelFetch(scene_light_tree, int(LIGHT_NODE_QUARTERS - 1u)).w;
    uint quarter = LIGHT_NODE_QUARTERS * nodes + light / LIGHT_TRAILS_PER_QUARTER;
    return texelFetch(scene_light_tree, int(quarter))[light % LIGHT_TRAILS_PER_QUARTER];
}

SceneEnvironment load_environment() {
    uvec4 q0 = texelFetch(scene_environment, 0);
    uvec4 q1 = texelFetch(scene_environment, 1);
    uvec4 q2 = texelFetch(scene_environment, 2);
    return SceneEnvironment(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), uintBitsToFloat(q2.w));
}

#endif
