// What the parallel lines of a bundle meet: a list for each texel, in the order of the depths along its line, of equal ones of the triangles' numbers. SVO-G6.
//
// Depths are of the line through the texel's middle, from where the bundle's view begins, and never below 0, so that their bits have their order. Twins:
// techniques/ray_bundles/lists.rs.
#ifndef CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_LIST_GLSL
#define CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_LIST_GLSL

// As the rasterizer finds it.
struct BundleFragment {
    float depth;
    uint triangle;
    uint texel;
};

struct BundleEntry {
    float depth;
    uint triangle;
};

uint bundle_texel(uvec2 texel, uint side) { return texel.y * side + texel.x; }

// Whether an entry comes before another of its list.
bool bundle_is_before(BundleEntry a, BundleEntry b) {
    uvec2 bits = uvec2(floatBitsToUint(a.depth), floatBitsToUint(b.depth));
    return bits.x < bits.y || (bits.x == bits.y && a.triangle < b.triangle);
}

#endif
