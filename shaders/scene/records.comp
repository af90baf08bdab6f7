#version 460
// The layout of the scene's records, for the host: from these blocks the Rust structs are made. Dispatched by a test only, which shows that
// the load functions find every word of a record where the host writes it.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

#define CLERESTORY_FLAT_SCENE
#include "scene/bindings.glsl"
#include "scene/media.glsl"

layout(set = 0, binding = 0, scalar) restrict writeonly buffer SceneRecords {
    SceneTriangle triangle;
    SceneMaterial material;
    SceneTexture texture_record;
    SceneLight light;
    SceneEnvironment environment;
    SceneMedium medium;
    SceneLightNode light_node;
    uint trails[2];
    SceneInstance instance;
} records;

void main() {
    records.triangle = stored_triangle(0u);
    records.material = load_material(0u);
    records.texture_record = load_texture(0u);
    records.light = load_light(0u);
    records.environment = load_environment();
    records.medium = load_medium(0u);
    records.light_node = load_light_node(0u);
    records.trails[0] = load_light_trail(0u);
    records.trails[1] = load_light_trail(5u);
    records.instance = load_instance(0u);
}
