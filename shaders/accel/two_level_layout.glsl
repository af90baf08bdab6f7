// How the index of two levels lies in memory.
//
// Texels: box of all (lower, texel where the triangles begin | upper, texel where the instances' records begin | places for nodes of the tree above,
// instances, 0, 0), nodes, records, triangles. Nodes are those of wide_layout.glsl, of the tree above, then of each mesh; their children, triangles and
// parents are counted over all. In the tree above slots hold child nodes alone, and the highest byte of a node's exponents says which of them stand
// for instances. In such a place lies what takes a ray into the mesh: three rows from world space, behind them flags, the parent as nodes have it, and the
// root of the mesh's tree | the translation to world space, the instance | what boxes are grown by, 0. An instance's record: three rows to world space,
// behind them the number of its first triangle, the number of its mesh's root among the nodes of all instances, and its place. Twin of
// clerestory::accel::two_level.
#ifndef CLERESTORY_ACCEL_TWO_LEVEL_LAYOUT_GLSL
#define CLERESTORY_ACCEL_TWO_LEVEL_LAYOUT_GLSL

const uint TWO_LEVEL_HEADER_TEXELS = 3u;
const uint TWO_LEVEL_INSTANCE_TEXELS = 3u;
// Where the bits of slots with instances begin in the word of a node's exponents.
const uint TWO_LEVEL_INSTANCE_SHIFT = 24u;

#endif
