#version 460
// The fragments of a bundle in the order of their lists: each goes to the place that as many others of its list come before. Lists are short; what is in one only reads the
// others, so that the result is the same however fragments came.
//
// Loops: one over a list, which the host keeps within what software devices' loops allow.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "techniques/ray_bundles/bundle_list.glsl"

layout(push_constant, scalar) uniform Push {
    uint first;
    uint end;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer BundleStarts { uint bundle_starts[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer BundleFragments { BundleFragment bundle_fragments[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer BundleEntries { BundleEntry bundle_entries[]; };

void main() {
    uint i = push.first + invocation_index();
    if (i >= push.end) {
        return;
    }
    BundleFragment fragment = bundle_fragments[i];
    BundleEntry own = BundleEntry(fragment.depth, fragment.triangle);
    uint start = bundle_starts[fragment.texel];
    uint list_end = bundle_starts[fragment.texel + 1u];
    uint before = 0u;
    uint other = start;
    do {
        BundleFragment f = bundle_fragments[other];
        before += bundle_is_before(BundleEntry(f.depth, f.triangle), own) ? 1u : 0u;
    } while (++other < list_end);
    bundle_entries[start + before] = own;
}
