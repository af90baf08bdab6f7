// What the parallel lines of a bundle meet: a list for each texel, in the order of the depths along its line, of equal ones of the triangles' numbers. SVO-G6.
//
// Depths are of the line through the texel's middle, from where the bundle's view begins, and never below 0, so that their bits have their order. An entry also says on which side
// the line meets its triangle. Twins: techniques/ray_bundles/lists.rs.
#ifndef CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_LIST_GLSL
#define CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_LIST_GLSL

// In the word of the triangle: its normal goes along the line.
const uint BUNDLE_ALONG = 0x80000000u;

// As the rasterizer finds it.
struct BundleFragment {
    float depth;
    uint triangle;  // and BUNDLE_ALONG
    uint texel;
};

struct BundleEntry {
    float depth;
    uint triangle;  // and BUNDLE_ALONG
};

uint bundle_triangle(BundleEntry entry) { return entry.triangle & ~BUNDLE_ALONG; }

uint bundle_texel(uvec2 texel, uint side) { return texel.y * side + texel.x; }

// Whether an entry comes before another of its list.
bool bundle_is_before(BundleEntry a, BundleEntry b) {
    uvec2 bits = uvec2(floatBitsToUint(a.depth), floatBitsToUint(b.depth));
    return bits.x < bits.y || (bits.x == bits.y && bundle_triangle(a) < bundle_triangle(b));
}

#endif
