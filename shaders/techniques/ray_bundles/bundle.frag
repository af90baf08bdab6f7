#version 460
// What the lines of a bundle meet of surfaces, all of it, whatever is in front: each fragment counts itself in its texel, or, drawn once more, writes itself to the texel's
// list, in any order, and counts itself off again.
//
// SVO-G6: lists by count and scan in place of the linked lists of T. Hermes, N. Henrich, T. Grosch, S. Müller, "Global Illumination using Parallel Global Ray-Bundles", VMV 2010.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const bool WRITES = true;
layout(constant_id = 1) const uint BUNDLE_SIDE = 512u;  // texels

#include "accel/ray.glsl"
#include "raster/hit.glsl"
#include "techniques/ray_bundles/bundle_list.glsl"

layout(location = 0) flat in uint raster_triangle;
layout(location = 1) flat in uint raster_view;

layout(set = 1, binding = 0, scalar) restrict buffer BundleCounts { uint bundle_counts[]; };
layout(set = 1, binding = 1, scalar) restrict readonly buffer BundleStarts { uint bundle_starts[]; };
layout(set = 1, binding = 2, scalar) restrict writeonly buffer BundleFragments { BundleFragment bundle_fragments[]; };

// Fragments of a texel that are left, at most: more are below 0.
const uint LEFT_MAX = 0x7FFFFFFFu;

void main() {
    uint texel = bundle_texel(uvec2(gl_FragCoord.xy), BUNDLE_SIDE);
    if (!WRITES) {
        // By the inputs of the other drawing: without flat ones Mesa's software rasterizer (22.3.6) goes another way, which loses triangles beside one without area.
        atomicAdd(bundle_counts[texel], raster_triangle == NO_HIT ? 0u : 1u);
        return;
    }
    uint left = atomicAdd(bundle_counts[texel], 0xFFFFFFFFu);
    // More than were counted: what is left is below 0, which the host sees.
    if (left == 0u || left > LEFT_MAX) {
        return;
    }
    RasterView view = raster_views[raster_view];
    SceneTriangle t = load_triangle(raster_triangle);
    uint along = dot(cross(t.b - t.a, t.c - t.a), view.forward) > 0.0 ? BUNDLE_ALONG : 0u;
    RasterHit hit = raster_hit(view, t, gl_FragCoord.xy);
    bundle_fragments[bundle_starts[texel] + left - 1u] = BundleFragment(max(hit.distance, 0.0), raster_triangle | along, texel);
}
