// How the binary hierarchy lies in memory, for what traverses it and for what makes it.
//
// A node is four texels ("quarters"): lower0 upper0.x | upper0.yz lower1.xy | lower1.z upper1 | child words, parent word, and of the root where
// the triangles begin. A triangle is three, behind the nodes: vertex 0, 1, 2, its index, two that are unused. Twin of
// clerestory::accel::bvh2::Bvh2Node and the leaf-ordered triangles.
#ifndef CLERESTORY_ACCEL_BVH2_LAYOUT_GLSL
#define CLERESTORY_ACCEL_BVH2_LAYOUT_GLSL

// Lowest bits of a child word: how many triangles a leaf holds, 0 of an inner node.
const uint BVH2_COUNT_BITS = 4u;
const uint BVH2_COUNT_MASK = (1u << BVH2_COUNT_BITS) - 1u;
const uint BVH2_NODE_QUARTERS = 4u;
const uint BVH2_TRIANGLE_QUARTERS = 3u;
const uint BVH2_NODE_WORDS = 4u * BVH2_NODE_QUARTERS;
const uint BVH2_TRIANGLE_WORDS = 4u * BVH2_TRIANGLE_QUARTERS;

#endif
