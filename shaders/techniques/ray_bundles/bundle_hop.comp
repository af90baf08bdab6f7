#version 460
// Leads eye paths along the lines of a bundle: from where a path is to the next entry of its texel's list, in the sense of its direction.
//
// SVO-G6. Where the texel's line meets the plane of the surface that is left the way begins, so that this surface is not met again however steep it stands; entries of the same
// triangle, and those that are nearer to the plane than rounding tells, are passed over; within a texel's width of the plane also those that are met on the same side as the surface is
// left, from behind: what is next to it where it is concave, beyond which the line begins. A path that meets nothing ends.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "accel/ray.glsl"
#include "finite.glsl"
#include "invocation.glsl"
#include "raster/hit.glsl"
#include "raster/project.glsl"
#include "techniques/ray_bundles/bundle_list.glsl"
#include "techniques/ray_bundles/bundle_vertex.glsl"

layout(push_constant, scalar) uniform Push {
    uint side;        // texels
    uint first_pixel;
    uint end_pixel;
    float skipped;    // distance from the plane up to which entries are passed over, metres
    float width;      // of a texel, the same of those from behind, metres
} push;

layout(set = 1, binding = 0, scalar) restrict readonly buffer BundleStarts { uint bundle_starts[]; };
layout(set = 1, binding = 1, scalar) restrict readonly buffer BundleEntries { BundleEntry bundle_entries[]; };
layout(set = 1, binding = 2, scalar) restrict buffer BundleVertices { BundleVertex bundle_vertices[]; };

// The first entry of a list, from `first` to before `end`, that lies deeper than `depth`; `end` where none does.
uint bundle_first_beyond(uint first, uint end, float depth) {
    // 32 halvings are enough for any list.
    for (uint halving = 0u; halving < 32u && first < end; ++halving) {
        uint middle = first + (end - first) / 2u;
        bool beyond = bundle_entries[middle].depth > depth;
        first = beyond ? first : middle + 1u;
        end = beyond ? middle : end;
    }
    return first;
}

// Entries from behind that are passed over at most.
const uint PASSED_MAX = 32u;

// Where a way begins on the line.
struct BundleStart {
    float depth;
    float margin;    // from there on nothing is met that is nearer than this
    float behind;    // nor, from behind, than this
    uint triangle;   // that is left, and BUNDLE_ALONG
};

bool is_passed(BundleEntry entry, BundleStart start) {
    bool is_behind = abs(entry.depth - start.depth) <= start.behind && ((entry.triangle ^ start.triangle) & BUNDLE_ALONG) == 0u;
    return is_behind || bundle_triangle(entry) == (start.triangle & ~BUNDLE_ALONG);
}

// The triangle that a way meets on the line, in one sense or the other; NO_HIT where it leaves.
uint bundle_next(uvec2 list, BundleStart start, bool deeper) {
    if (deeper) {
        uint next = bundle_first_beyond(list.x, list.y, start.depth + start.margin);
        for (uint passed = 0u; passed < PASSED_MAX && next < list.y && is_passed(bundle_entries[next], start); ++passed) {
            ++next;
        }
        return next < list.y ? bundle_triangle(bundle_entries[next]) : NO_HIT;
    }
    uint before = bundle_first_beyond(list.x, list.y, start.depth - start.margin);
    for (uint passed = 0u; passed < PASSED_MAX && before > list.x && is_passed(bundle_entries[before - 1u], start); ++passed) {
        --before;
    }
    return before > list.x ? bundle_triangle(bundle_entries[before - 1u]) : NO_HIT;
}

// Not a number for a triangle without area. Edges are scaled, so that the squares of small ones do not vanish.
vec3 plane_normal(SceneTriangle t) {
    vec3 e1 = t.b - t.a;
    vec3 e2 = t.c - t.a;
    float longest = largest_component(max(abs(e1), abs(e2)));
    return normalize(cross(e1 / longest, e2 / longest));
}

void main() {
    uint i = push.first_pixel + invocation_index();
    if (i >= push.end_pixel) {
        return;
    }
    BundleVertex vertex = bundle_vertices[i];
    if (vertex.triangle == NO_HIT) {
        return;
    }
    RasterView view = raster_views[0];
    SceneTriangle t = load_triangle(vertex.triangle);
    vec3 at = t.a + (vertex.barycentrics.x * (t.b - t.a) + vertex.barycentrics.y * (t.c - t.a));
    vec3 from = raster_relative(view, at);
    vec2 place = vec2(raster_row(view.x, from), raster_row(view.y, from));
    vec2 pixel = (place - vec2(view.offset_x, view.offset_y)) / vec2(view.scale_x, view.scale_y);
    uvec2 texel = uvec2(clamp(pixel, vec2(0.0), vec2(float(push.side) - 1.0)));
    vec2 middle = vec2(texel) + 0.5;
    vec3 line = raster_across(view, raster_place(view, middle));
    vec3 normal = plane_normal(t);
    float cosine = dot(normal, view.forward);
    float depth = dot(normal, from - line) / cosine;
    uint along = cosine > 0.0 ? BUNDLE_ALONG : 0u;
    BundleStart start = BundleStart(depth, push.skipped / abs(cosine), push.width / abs(cosine), vertex.triangle | along);
    uint number = bundle_texel(texel, push.side);
    uvec2 list = uvec2(bundle_starts[number], bundle_starts[number + 1u]);
    bool deeper = dot(vertex.direction, view.forward) > 0.0;
    // Lines in the plane of the surface meet nothing.
    bool is_crossed = abs(depth) <= FINITE_MAX && start.behind <= FINITE_MAX;
    uint next = is_crossed ? bundle_next(list, start, deeper) : NO_HIT;
    vertex.triangle = next;
    if (next != NO_HIT) {
        vertex.barycentrics = raster_hit(view, load_triangle(next), middle).weights.yz;
    }
    bundle_vertices[i] = vertex;
}
