// Look-ups in shadow maps of spots and of parallel light, with percentage-closer filtering: the share of a square of texels, `width` wide about the place, that are no nearer than the
// receiver; those at its rim count by how much of them it covers. What a map does not show is lit. What includes it binds the maps as `view_distances`: metres, map by map, row by row.
#ifndef CLERESTORY_RASTER_VIEW_SHADOW_SET_GLSL
#define CLERESTORY_RASTER_VIEW_SHADOW_SET_GLSL

#include "raster/view_shadow.glsl"

// 1 where the texel's surface is no nearer than the receiver; beyond the edges texels repeat those there.
float view_shadow_tap(ShadowView view, ViewReceiver r, uint map, int side, ivec2 at) {
    at = clamp(at, ivec2(0), ivec2(side - 1));
    uint row = map * uint(side) + uint(at.y);
    float seen = view_distances[row * uint(side) + uint(at.x)];
    return seen < shadow_view_threshold(view, r, (2.0 * vec2(at) + 1.0) / float(side) - 1.0) ? 0.0 : 1.0;
}

// Share of the light that reaches a place on a surface. `width`: texels, 0 takes the nearest texel alone; `normal`: geometric, unit, of either side; `slack`: see
// shadow_view_receiver.
float view_shadow_visibility(ShadowView view, uint map, int side, int width, vec3 position, vec3 normal, float slack) {
    ViewReceiver r = shadow_view_receiver(view, side, width, position, normal, slack);
    bool is_shown = all(lessThanEqual(abs(shadow_view_place(view, position).xy), vec2(1.0)));
    if (!(r.distance > 0.0) || !is_shown) {
        return 1.0;
    }
    vec2 place = (0.5 * r.place + 0.5) * float(side);
    if (width == 0) {
        return view_shadow_tap(view, r, map, side, ivec2(floor(place)));
    }
    vec2 low = place - 0.5 * float(width);
    ivec2 first = ivec2(floor(low));
    vec2 part = low - floor(low);
    float sum = 0.0;
    float weights = 0.0;  // summed alike, so that what is lit as a whole has a share of exactly 1
    for (int y = 0; y <= width; ++y) {
        for (int x = 0; x <= width; ++x) {
            float weight = shadow_weight(x, width, part.x) * shadow_weight(y, width, part.y);
            sum += weight * view_shadow_tap(view, r, map, side, first + ivec2(x, y));
            weights += weight;
        }
    }
    return sum == weights ? 1.0 : sum / weights;
}

#endif
