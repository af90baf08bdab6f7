// The buffer of the binary hierarchy, set 1; twin of clerestory::accel::bvh2::Bvh2Node and the leaf-ordered triangles.
#ifndef CLERESTORY_ACCEL_BVH2_BINDINGS_GLSL
#define CLERESTORY_ACCEL_BVH2_BINDINGS_GLSL

// descriptor set 1: Bvh2Set

// A node is four quarters: lower0 upper0.x | upper0.yz lower1.xy | lower1.z upper1 | child words, parent word, and of the root where the triangles
// begin. A triangle is three, behind the nodes: vertex 0, 1, 2, its index, two that are unused.
layout(set = 1, binding = 0, scalar) restrict readonly buffer Bvh2Quarters {
    uvec4 bvh2_quarters[];
};

#endif
