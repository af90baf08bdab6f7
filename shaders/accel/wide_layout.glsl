// How the wide hierarchy lies in memory.
//
// Texels: the box of all (lower, texel where the triangles begin | upper, 0), nodes, triangles. A node is five texels: corner of its grid, three
// biased exponents of the grid's steps, a byte each | its first child node, its first triangle, what its slots hold, its parent × 8 + slot there |
// planes along x, y and z, a texel each: lower ones of eight slots, then upper ones, a byte each. A slot holds a child node (bit 24 + slot), or
// one to three triangles (bits 3 × slot on), or nothing; children and triangles follow in the order of slots. A triangle is three texels as in
// bvh2_layout.glsl. Twin of clerestory::accel::wide::WideNode.
#ifndef CLERESTORY_ACCEL_WIDE_LAYOUT_GLSL
#define CLERESTORY_ACCEL_WIDE_LAYOUT_GLSL

const uint WIDE_HEADER_TEXELS = 2u;
const uint WIDE_NODE_TEXELS = 5u;
const uint WIDE_TRIANGLE_TEXELS = 3u;
const uint WIDE_SLOTS = 8u;
const uint WIDE_SLOT_BITS = 3u;
const uint WIDE_SLOT_MASK = WIDE_SLOTS - 1u;
// Most triangles of a slot.
const uint WIDE_LEAF_SIZE = 3u;
// Most triangles of a node.
const uint WIDE_NODE_TRIANGLES = WIDE_SLOTS * WIDE_LEAF_SIZE;
// Where the bits of child nodes begin in the word that says what slots hold.
const uint WIDE_INNER_SHIFT = WIDE_NODE_TRIANGLES;
const uint WIDE_TRIANGLE_MASK = (1u << WIDE_INNER_SHIFT) - 1u;
const uint WIDE_ORDER_MASK = (1u << WIDE_SLOTS) - 1u;
// Where the exponent stands in a number.
const uint WIDE_EXPONENT_SHIFT = 23u;
const uint WIDE_EXPONENT_MASK = 0xFFu << WIDE_EXPONENT_SHIFT;

#endif
