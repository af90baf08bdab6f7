// Buffers of the binary hierarchy, set 1; twins of clerestory::accel::bvh2::Bvh2Node and the leaf-ordered triangles.
#ifndef CLERESTORY_ACCEL_BVH2_BINDINGS_GLSL
#define CLERESTORY_ACCEL_BVH2_BINDINGS_GLSL

// descriptor set 1: Bvh2Set

// Four quarters, so that four wide loads bring it: both children's boxes, child words, parent word.
struct Bvh2Node {
    vec4 lower0_upper0x;
    vec4 upper0yz_lower1xy;
    vec4 lower1z_upper1;
    uvec4 children_parent;
};

struct Bvh2Triangle {
    vec3 v0;
    vec3 v1;
    vec3 v2;
};

layout(set = 1, binding = 0, scalar) restrict readonly buffer Bvh2Nodes {
    Bvh2Node bvh2_nodes[];
};

layout(set = 1, binding = 1, scalar) restrict readonly buffer Bvh2Triangles {
    Bvh2Triangle bvh2_triangles[];
};

layout(set = 1, binding = 2, scalar) restrict readonly buffer Bvh2Indices {
    uint bvh2_indices[];
};

#endif
