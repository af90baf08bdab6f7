// Records of a scene in device memory, all of whole quarters (four words), so that four-word texels hold them.
#ifndef CLERESTORY_SCENE_RECORDS_GLSL
#define CLERESTORY_SCENE_RECORDS_GLSL

const uint NO_LIGHT = 0xFFFFFFFFu;
const uint NO_TEXTURE = 0xFFFFFFFFu;

const uint MATERIAL_DOUBLE_SIDED = 1u;
const uint MATERIAL_UNLIT = 2u;
const uint MATERIAL_EXACT_CONDUCTOR = 4u;
const uint MATERIAL_MASK = 8u;
const uint MATERIAL_BLEND = 16u;
const uint MATERIAL_BOUNDARY = 32u;  // not there but for the medium that it bounds
const uint MATERIAL_PHONG = 64u;     // its metal is a modified Phong lobe
// BSDF_SCHLICK_CONDUCTOR and its like, shifted by this: what the conductor's three vectors hold; and BSDF_CLASSIC_FLAGS.
const uint MATERIAL_FORM_SHIFT = 8u;

const uint LIGHT_TRIANGLE = 0u;
const uint LIGHT_POINT = 1u;
const uint LIGHT_SPOT = 2u;
const uint LIGHT_DIRECTIONAL = 3u;
const uint LIGHT_ENVIRONMENT = 4u;
const uint LIGHT_DARK = 5u;  // stands alone where no light can be chosen

const uint TRIANGLE_QUARTERS = 3u;
const uint MATERIAL_QUARTERS = 10u;
const uint TEXTURE_QUARTERS = 3u;
const uint LIGHT_QUARTERS = 4u;
const uint ENVIRONMENT_HEADER_QUARTERS = 3u;
const uint MEDIUM_QUARTERS = 9u;
const uint HOMOGENEOUS_MEDIUM_QUARTERS = 3u;  // of one without a grid
const uint LIGHT_NODE_QUARTERS = 4u;

const uint LIGHT_NODE_LEAF = 0x80000000u;     // in `child`: what remains is a light
const uint LIGHT_TREE_DEPTH_MAX = 30u;        // steps from the root to a light, a bit of its trail each
const uint LIGHT_TRAIL_NONE = 0xFFFFFFFFu;    // of a light that is not in the tree
const uint LIGHT_TRAILS_PER_QUARTER = 4u;
const uint INSTANCE_QUARTERS = 4u;

const uint PHASE_ISOTROPIC = 0u;
const uint PHASE_HENYEY_GREENSTEIN = 1u;
const uint PHASE_SCHLICK = 2u;
const uint PHASE_RAYLEIGH = 3u;

struct SceneTriangle {
    vec3 a;
    uint material;
    vec3 b;
    uint light;  // index of its light, or NO_LIGHT
    vec3 c;
    uint around;  // of a body: material of the body that it is inside of, plus one; 0 without
};

// A mesh in a place, or meshes that are where they are and follow each other.
struct SceneInstance {
    vec3 row_x;       // rows of what takes it to world space
    uint first;       // number of its first triangle
    vec3 row_y;
    uint record;      // where that is stored
    vec3 row_z;
    uint flags;       // INSTANCE_*
    vec3 translation;
    float spare;
};

struct SceneMaterial {
    vec3 base_color;
    float base_alpha;
    vec3 emission;
    uint flags;       // beside the emission: of a lamp's material nothing else is read
    vec3 specular_color;
    float roughness;
    vec3 conductor_a;
    float transmission;
    vec3 conductor_b;
    float ior;
    vec3 conductor_c;
    float specular;
    vec3 absorption;  // absorption coefficient inside, 1/m
    float thickness;
    float alpha_cutoff;
    float normal_scale;
    float metallic;
    uint base_color_texture;
    uint metallic_roughness_texture;
    uint emission_texture;
    uint normal_texture;
    uint specular_texture;
    uint specular_color_texture;
    uint transmission_texture;
    uint interior;  // index of the medium inside, plus one; 0 without
    uint spare;
};

struct SceneTexture {
    vec3 transform_u;  // uv' = (dot(row, (u, v, 1)))
    uint first_texel;
    vec3 transform_v;
    uint size;   // width | height << 16
    uint flags;  // TEXTURE_*
    uvec3 spare;
};

struct SceneLight {
    uint kind;
    uint triangle;
    uint around;        // material of the body that it is inside of, plus one; 0 without, and where nothing asks
    uint spare;         // a technique's own
    vec3 position;      // point, spot
    float cos_inner;
    vec3 direction;     // spot axis, direction of travel
    float cos_outer;
    vec3 strength;      // W/sr, W/m2; unused for triangles and the environment
    float spare_strength;
};

// A node of the tree of lights: what its lights send, from where and to where.
struct SceneLightNode {
    vec3 center;       // of the box around them
    float strength;    // sum of their greatest intensities, 1 for that of the strongest light
    vec3 half_extent;  // of the box
    float radius;      // half of its diagonal
    vec3 axis;         // of the cone of their normals
    float cos_spread;  // cosine of its half angle; -1 for all directions
    float cos_reach;   // cosine of how far beyond their normals they shine
    float share;       // probability of the first child where it is fixed; 0 where it follows from the importances
    uint child;        // first child, which the second one is behind; of a leaf its light, with LIGHT_NODE_LEAF
    uint node_count;   // of the tree, in the root; the trails of all lights follow
};

// A medium: coefficients at density 1, and where the grid of its density is.
struct SceneMedium {
    vec3 sigma_s;          // 1/m
    uint phase;            // PHASE_*
    vec3 sigma_t;          // 1/m
    float phase_parameter;
    vec3 emission;         // W/(m3 sr)
    float majorant;        // at least every band of sigma_t and positive where there is emission, 1/m
    vec3 row_x;            // from world space to cells of the grid, with the components of `offset`
    uint has_grid;
    vec3 row_y;
    uint first_density;
    vec3 row_z;
    uint first_majorant;
    vec3 offset;
    float block;           // cells along the side of a block with one majorant
    uvec3 cells;
    float density_max;     // of the grid
    uvec3 blocks;
    float tightness;       // mean density over the mean of the blocks' greatest ones
};

// What stands before an environment's texels: its axes in world space, its size, where its probabilities begin.
struct SceneEnvironment {
    vec3 right;
    uint width;
    vec3 up;
    uint height;
    vec3 back;
    float left_out;  // luminance that light sampling leaves to scattered rays
};

#endif
