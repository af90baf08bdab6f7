#version 460
// Look-ups in the shadow map of a spot or of parallel light, one per query, with percentage-closer filtering: the share of a square of texels, `width` wide about the place, that are no
// nearer than the receiver; those at its rim count by how much of them it covers. What the map does not show is lit.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "invocation.glsl"
#include "raster/shadow_query.glsl"
#include "raster/view_shadow.glsl"

layout(push_constant, scalar) uniform Push {
    ShadowView view;
    uint count;
    uint map;
    int side;
    int width;  // texels; 0 takes the nearest texel alone
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer Queries { ShadowQuery queries[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer Shares { float shares[]; };
// Metres: map by map, row by row.
layout(set = 0, binding = 2, scalar) restrict readonly buffer ViewDistances { float view_distances[]; };

// 1 where the texel's surface is no nearer than the receiver; beyond the edges texels repeat those there.
float tap(ViewReceiver r, ivec2 at) {
    at = clamp(at, ivec2(0), ivec2(push.side - 1));
    uint row = push.map * uint(push.side) + uint(at.y);
    float seen = view_distances[row * uint(push.side) + uint(at.x)];
    return seen < shadow_view_threshold(push.view, r, (2.0 * vec2(at) + 1.0) / float(push.side) - 1.0) ? 0.0 : 1.0;
}

float visibility(ShadowQuery q) {
    ViewReceiver r = shadow_view_receiver(push.view, push.side, push.width, q.position, q.normal, q.slack);
    bool is_shown = all(lessThanEqual(abs(shadow_view_place(push.view, q.position).xy), vec2(1.0)));
    if (!(r.distance > 0.0) || !is_shown) {
        return 1.0;
    }
    vec2 place = (0.5 * r.place + 0.5) * float(push.side);
    if (push.width == 0) {
        return tap(r, ivec2(floor(place)));
    }
    vec2 low = place - 0.5 * float(push.width);
    ivec2 first = ivec2(floor(low));
    vec2 part = low - floor(low);
    float sum = 0.0;
    float weights = 0.0;  // summed alike, so that what is lit as a whole has a share of exactly 1
    for (int y = 0; y <= push.width; ++y) {
        for (int x = 0; x <= push.width; ++x) {
            float weight = shadow_weight(x, push.width, part.x) * shadow_weight(y, push.width, part.y);
            sum += weight * tap(r, first + ivec2(x, y));
            weights += weight;
        }
    }
    return sum == weights ? 1.0 : sum / weights;
}

void main() {
    uint i = invocation_index();
    if (i < push.count) {
        shares[i] = visibility(queries[i]);
    }
}
