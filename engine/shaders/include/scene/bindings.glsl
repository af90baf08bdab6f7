// The scene on the device: set 2, filled by clerestory::transport::GpuScene. What a scene lacks is a buffer of 16 bytes that no
// specialized kernel reads. Triangles are in world space and keep their order in the scene.
#ifndef CLERESTORY_SCENE_BINDINGS_GLSL
#define CLERESTORY_SCENE_BINDINGS_GLSL

// descriptor set 2: SceneSet

const uint NO_LIGHT = 0xFFFFFFFFu;
const uint NO_TEXTURE = 0xFFFFFFFFu;

const uint MATERIAL_DOUBLE_SIDED = 1u;
const uint MATERIAL_UNLIT = 2u;
const uint MATERIAL_CONDUCTOR = 4u;
const uint MATERIAL_MASK = 8u;
const uint MATERIAL_BLEND = 16u;

const uint LIGHT_TRIANGLE = 0u;
const uint LIGHT_POINT = 1u;
const uint LIGHT_SPOT = 2u;
const uint LIGHT_DIRECTIONAL = 3u;
const uint LIGHT_ENVIRONMENT = 4u;
const uint LIGHT_DARK = 5u;  // stands alone where no light can be chosen

struct SceneTriangle {
    uvec3 vertices;
    uint material;
    uint light;  // index of its light, or NO_LIGHT
};

struct SceneMaterial {
    vec3 base_color;
    float base_alpha;
    vec3 emission;
    float metallic;
    vec3 specular_color;
    float roughness;
    vec3 conductor_eta;
    float transmission;
    vec3 conductor_k;
    float ior;
    vec3 conductor_average;
    float specular;
    vec3 absorption;  // coefficient inside, 1/m
    float thickness;
    float alpha_cutoff;
    float normal_scale;
    uint flags;
    uint base_color_texture;
    uint metallic_roughness_texture;
    uint emission_texture;
    uint normal_texture;
    uint specular_texture;
    uint specular_color_texture;
    uint transmission_texture;
};

struct SceneTexture {
    vec3 transform_u;  // uv' = (dot(row, (u, v, 1)))
    uint first_texel;
    vec3 transform_v;
    uint size;   // width | height << 16
    uint flags;  // TEXTURE_*
};

struct SceneLight {
    vec3 position;      // point, spot
    uint kind;
    vec3 direction;     // spot axis, direction of travel
    uint triangle;
    vec3 strength;      // W/sr, W/m2; unused for triangles and the environment
    float cos_inner;
    float cos_outer;
};

layout(set = 2, binding = 0, scalar) restrict readonly buffer ScenePositions { vec3 scene_positions[]; };
layout(set = 2, binding = 1, scalar) restrict readonly buffer SceneTriangles { SceneTriangle scene_triangles[]; };
layout(set = 2, binding = 2, scalar) restrict readonly buffer SceneNormals { vec3 scene_normals[]; };
layout(set = 2, binding = 3, scalar) restrict readonly buffer SceneUvs { vec4 scene_uvs[]; };  // set 0, set 1
layout(set = 2, binding = 4, scalar) restrict readonly buffer SceneTangents { vec4 scene_tangents[]; };
layout(set = 2, binding = 5, scalar) restrict readonly buffer SceneColors { vec4 scene_colors[]; };
layout(set = 2, binding = 6, scalar) restrict readonly buffer SceneMaterials { SceneMaterial scene_materials[]; };
layout(set = 2, binding = 7, scalar) restrict readonly buffer SceneTextures { SceneTexture scene_textures[]; };
layout(set = 2, binding = 8, scalar) restrict readonly buffer SceneTexels { uint scene_texels[]; };  // RGBA8
layout(set = 2, binding = 9, scalar) restrict readonly buffer SceneLights { SceneLight scene_lights[]; };
// Cumulative probabilities: of the lights, then (from environment_cdf_base on) of the environment's texels.
layout(set = 2, binding = 10, scalar) restrict readonly buffer SceneCdf { float scene_cdf[]; };
layout(set = 2, binding = 11, scalar) restrict readonly buffer SceneEnvironment {
    vec3 environment_right;  // the environment's axes in world space
    uint environment_width;
    vec3 environment_up;
    uint environment_height;
    vec3 environment_back;
    uint environment_cdf_base;
    float environment_texels[];  // RGB radiance
};
layout(set = 2, binding = 12, scalar) restrict readonly buffer SceneAlbedoTable { float scene_albedo_table[]; };

float distribution_cdf(uint index) { return scene_cdf[index]; }
float albedo_table(uint index) { return scene_albedo_table[index]; }

#endif
