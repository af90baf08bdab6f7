// The scene on the device: set 2, filled by clerestory::transport::GpuScene. What a scene lacks is a buffer of one texel that no
// specialized kernel reads. Triangles are in world space and keep their order in the scene, unless instances are kept: then those of meshes that are
// placed often are stored once, in the space of the mesh, and the load functions make what stands for a triangle's number.
//
// Everything is read by texel fetches, which software drivers gather for all lanes at once, where they load storage buffers lane by lane and
// word by word. Records are in quarters (four words); the load functions name their fields, and scene/records.comp tells the host.
#ifndef CLERESTORY_SCENE_BINDINGS_GLSL
#define CLERESTORY_SCENE_BINDINGS_GLSL

#extension GL_EXT_samplerless_texture_functions : require

#include "scene/fetches.glsl"
#include "scene/instance.glsl"
#include "scene/records.glsl"

// Instances are kept. Includers that draw triangles by their places define CLERESTORY_FLAT_SCENE and are not given such scenes.
#ifdef CLERESTORY_FLAT_SCENE
const bool HAS_INSTANCES = false;
#else
layout(constant_id = 29) const bool HAS_INSTANCES = false;
#endif

// descriptor set 2: SceneSet

layout(set = 2, binding = 0) uniform utextureBuffer scene_triangles;
layout(set = 2, binding = 1) uniform utextureBuffer scene_vertices;  // by triangle: its vertices' places in the attributes
layout(set = 2, binding = 2) uniform textureBuffer scene_normals;    // by vertex: xyz
layout(set = 2, binding = 3) uniform textureBuffer scene_uvs;        // set 0, set 1
layout(set = 2, binding = 4) uniform textureBuffer scene_tangents;
layout(set = 2, binding = 5) uniform textureBuffer scene_colors;
layout(set = 2, binding = 6) uniform utextureBuffer scene_materials;  // records, then nodes of tables of metals, the last one first
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
layout(set = 2, binding = 14) uniform utextureBuffer scene_instances;  // by their first triangles, ascending

float distribution_cdf(uint index) {
    count_fetches(1u, 1u);
    return texelFetch(scene_cdf, int(index)).x;
}
vec4 environment_texel(uint index) {
    count_quarters(1u);
    return uintBitsToFloat(texelFetch(scene_environment, int(ENVIRONMENT_HEADER_QUARTERS + index)));
}
float albedo_table(uint index) {
    count_fetches(1u, 1u);
    return texelFetch(scene_albedo_table, int(index)).x;
}

// A node of the tables of metals that name one.
vec4 fresnel_table(uint index) {
    count_quarters(1u);
    return uintBitsToFloat(texelFetch(scene_materials, textureSize(scene_materials) - 1 - int(index)));
}

uvec4 material_quarter(uint material, uint quarter) { return texelFetch(scene_materials, int(MATERIAL_QUARTERS * material + quarter)); }

uint light_count() { return uint(textureSize(scene_lights)) / LIGHT_QUARTERS; }

// Where the table of the environment's cells begins, behind that of the lights.
uint environment_cdf_base() { return light_count() + 1u; }

SceneTriangle stored_triangle(uint record) {
    count_quarters(TRIANGLE_QUARTERS);
    int first = int(TRIANGLE_QUARTERS * record);
    uvec4 q0 = texelFetch(scene_triangles, first);
    uvec4 q1 = texelFetch(scene_triangles, first + 1);
    uvec4 q2 = texelFetch(scene_triangles, first + 2);
    return SceneTriangle(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), q2.w);
}

SceneInstance load_instance(uint index) {
    count_quarters(INSTANCE_QUARTERS);
    int first = int(INSTANCE_QUARTERS * index);
    uvec4 q0 = texelFetch(scene_instances, first);
    uvec4 q1 = texelFetch(scene_instances, first + 1);
    uvec4 q2 = texelFetch(scene_instances, first + 2);
    vec4 q3 = uintBitsToFloat(texelFetch(scene_instances, first + 3));
    return SceneInstance(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), q2.w, q3.xyz, q3.w);
}

// The instance that a triangle is of: the last whose first triangle does not come behind it. Without instances what stands for the world.
SceneInstance instance_of(uint triangle) {
    if (!HAS_INSTANCES) {
        return SceneInstance(vec3(0.0), 0u, vec3(0.0), 0u, vec3(0.0), INSTANCE_IDENTITY, vec3(0.0), 0.0);
    }
    uint low = 0u;
    uint beyond = uint(textureSize(scene_instances)) / INSTANCE_QUARTERS;
    while (beyond - low > 1u) {
        uint middle = low + beyond >> 1;
        count_quarters(1u);
        bool behind = texelFetch(scene_instances, int(INSTANCE_QUARTERS * middle)).w > triangle;
        beyond = behind ? middle : beyond;
        low = behind ? low : middle;
    }
    return load_instance(low);
}

// Where a triangle of an instance is stored.
uint instance_record(SceneInstance at, uint triangle) { return HAS_INSTANCES ? at.record + (triangle - at.first) : triangle; }

bool instance_has(SceneInstance at, uint flag) { return HAS_INSTANCES && (at.flags & flag) != 0u; }

vec3 instance_position(SceneInstance at, vec3 p) {
    bool is_image = HAS_INSTANCES && !instance_has(at, INSTANCE_IDENTITY);
    return is_image ? instance_vertex(at.row_x, at.row_y, at.row_z, at.translation, p) : p;
}

// A triangle of an instance, in world space.
SceneTriangle load_triangle_of(SceneInstance at, uint index) {
    SceneTriangle t = stored_triangle(instance_record(at, index));
    bool swaps = instance_has(at, INSTANCE_MIRRORED);
    vec3 b = swaps ? t.c : t.b;
    vec3 c = swaps ? t.b : t.c;
    return SceneTriangle(instance_position(at, t.a), t.material, instance_position(at, b), t.light, instance_position(at, c), t.around);
}

SceneTriangle load_triangle(uint index) { return load_triangle_of(instance_of(index), index); }

// Vertices of a triangle, for its attributes.
uvec3 load_vertices_of(SceneInstance at, uint index) {
    count_quarters(1u);
    uvec3 v = texelFetch(scene_vertices, int(instance_record(at, index))).xyz;
    return instance_has(at, INSTANCE_MIRRORED) ? v.xzy : v;
}

uvec3 load_vertices(uint index) { return load_vertices_of(instance_of(index), index); }

vec3 normalize_or_zero(vec3 v) {
    float squared = dot(v, v);
    return squared > 0.0 ? v * inversesqrt(squared) : vec3(0.0);
}

// Normal of a vertex in world space, or zero, which stands for "flat". Cofactors transform normals without dividing by a determinant.
vec3 load_normal(SceneInstance at, uint vertex) {
    count_quarters(1u);
    vec3 n = texelFetch(scene_normals, int(vertex)).xyz;
    if (!HAS_INSTANCES || instance_has(at, INSTANCE_IDENTITY)) {
        return n;
    }
    vec3 world = vec3(dot(cross(at.row_y, at.row_z), n), dot(cross(at.row_z, at.row_x), n), dot(cross(at.row_x, at.row_y), n));
    return normalize_or_zero(instance_has(at, INSTANCE_MIRRORED) ? -world : world);
}

// Tangent of a vertex in world space, with the sign of the bitangent.
vec4 load_tangent(SceneInstance at, uint vertex) {
    count_quarters(1u);
    vec4 t = texelFetch(scene_tangents, int(vertex));
    if (!HAS_INSTANCES || instance_has(at, INSTANCE_IDENTITY)) {
        return t;
    }
    return vec4(normalize_or_zero(instance_rows(at.row_x, at.row_y, at.row_z, t.xyz)), instance_has(at, INSTANCE_MIRRORED) ? -t.w : t.w);
}

SceneMaterial load_material(uint index) {
    vec4 f0 = uintBitsToFloat(material_quarter(index, 0u));
    uvec4 q1 = material_quarter(index, 1u);
    vec4 f2 = uintBitsToFloat(material_quarter(index, 2u));
    vec4 f3 = uintBitsToFloat(material_quarter(index, 3u));
    vec4 f4 = uintBitsToFloat(material_quarter(index, 4u));
    vec4 f5 = uintBitsToFloat(material_quarter(index, 5u));
    vec4 f6 = uintBitsToFloat(material_quarter(index, 6u));
    uvec4 q7 = material_quarter(index, 7u);
    uvec4 q8 = material_quarter(index, 8u);
    uvec4 q9 = material_quarter(index, 9u);
    return SceneMaterial(f0.xyz, f0.w, uintBitsToFloat(q1.xyz), q1.w, f2.xyz, f2.w, f3.xyz, f3.w, f4.xyz, f4.w, f5.xyz, f5.w, f6.xyz, f6.w,
                         uintBitsToFloat(q7.x), uintBitsToFloat(q7.y), uintBitsToFloat(q7.z), q7.w, q8.x, q8.y, q8.z, q8.w, q9.x, q9.y, q9.z,
                         q9.w);
}

SceneTexture load_texture(uint index) {
    count_quarters(TEXTURE_QUARTERS);
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
    return SceneLight(q0.x, q0.y, q0.z, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, q3.xyz, q3.w);
}

SceneLightNode load_light_node(uint index) {
    count_quarters(LIGHT_NODE_QUARTERS);
    int first = int(LIGHT_NODE_QUARTERS * index);
    vec4 q0 = uintBitsToFloat(texelFetch(scene_light_tree, first));
    vec4 q1 = uintBitsToFloat(texelFetch(scene_light_tree, first + 1));
    vec4 q2 = uintBitsToFloat(texelFetch(scene_light_tree, first + 2));
    uvec4 q3 = texelFetch(scene_light_tree, first + 3);
    return SceneLightNode(q0.xyz, q0.w, q1.xyz, q1.w, q2.xyz, q2.w, uintBitsToFloat(q3.x), uintBitsToFloat(q3.y), q3.z, q3.w);
}

// The way from the root to a light: a bit a step, the first step last, set where it goes to the second child.
uint load_light_trail(uint light) {
    count_quarters(2u);
    uint nodes = texelFetch(scene_light_tree, int(LIGHT_NODE_QUARTERS - 1u)).w;
    uint quarter = LIGHT_NODE_QUARTERS * nodes + light / LIGHT_TRAILS_PER_QUARTER;
    return texelFetch(scene_light_tree, int(quarter))[light % LIGHT_TRAILS_PER_QUARTER];
}

SceneEnvironment load_environment() {
    count_quarters(ENVIRONMENT_HEADER_QUARTERS);
    uvec4 q0 = texelFetch(scene_environment, 0);
    uvec4 q1 = texelFetch(scene_environment, 1);
    uvec4 q2 = texelFetch(scene_environment, 2);
    return SceneEnvironment(uintBitsToFloat(q0.xyz), q0.w, uintBitsToFloat(q1.xyz), q1.w, uintBitsToFloat(q2.xyz), uintBitsToFloat(q2.w));
}

#endif
