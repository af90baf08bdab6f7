// What the stages of the linear hierarchy's build share: numbers as keys, the state of a build, and constants.
//
// Boxes are kept as integers in the order of the numbers, so that minimum and maximum are exact on every device, also of numbers that it
// would flush to zero.
#ifndef CLERESTORY_ACCEL_LBVH_GLSL
#define CLERESTORY_ACCEL_LBVH_GLSL

#include "accel/bvh2_layout.glsl"

const uint LBVH_GROUP_SIZE = 64u;
// Triangles whose boxes an invocation makes: the more, the fewer atomic operations.
const uint LBVH_BOXES_PER_INVOCATION = 16u;
// Quarters of a node between the stages: boxes of both children, their words, two that are unused.
const uint LBVH_NODE_QUARTERS = 4u;
// Quarters of a primitive's box, of which two words are unused.
const uint LBVH_BOX_QUARTERS = 2u;
// More steps than any way to the root has: bits of a code and of a place.
const uint LBVH_MAX_ASCENT = 96u;

// What the stages tell each other and the host. The host writes the first two before the build: least and greatest integers.
struct LbvhState {
    // Of twice the centres, as ordered integers.
    int centres_lower[3];
    int centres_upper[3];
    vec3 grid_lower;
    vec3 grid_scale;
    // Split of the root, and most inner nodes on a way from it.
    uint root;
    uint height;
    // Inner nodes written.
    uint nodes;
    // Expected node visits and triangle tests (surface area heuristic, unit costs) times half the area of the root's box, and that area.
    float cost;
    float area;
    uint padding;
};

struct LbvhBox {
    ivec3 lower;
    ivec3 upper;
};

// The integer of a number, ascending as the numbers are; both zeros become one.
int ordered_integer(float x) {
    int bits = floatBitsToInt(x);
    bits = bits == int(0x80000000u) ? 0 : bits;
    return bits ^ ((bits >> 31) & 0x7FFFFFFF);
}

ivec3 ordered_integers(vec3 v) { return ivec3(ordered_integer(v.x), ordered_integer(v.y), ordered_integer(v.z)); }

// The numbers of ordered integers.
vec3 ordered_floats(ivec3 v) { return intBitsToFloat(v ^ ((v >> 31) & 0x7FFFFFFF)); }

LbvhBox lbvh_union(LbvhBox a, LbvhBox b) { return LbvhBox(min(a.lower, b.lower), max(a.upper, b.upper)); }

float lbvh_half_area(LbvhBox box) {
    precise vec3 e = ordered_floats(box.upper) - ordered_floats(box.lower);
    precise float area = e.x * e.y + e.y * e.z + e.z * e.x;
    return area;
}

#endif
