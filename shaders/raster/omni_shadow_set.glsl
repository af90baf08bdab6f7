// Look-ups in omnidirectional shadow maps: set 3, filled by clerestory::raster::OmniShadowMaps.
#ifndef CLERESTORY_RASTER_OMNI_SHADOW_SET_GLSL
#define CLERESTORY_RASTER_OMNI_SHADOW_SET_GLSL

#include "raster/omni_shadow.glsl"

layout(constant_id = 130) const uint SHADOW_KIND = SHADOW_CUBE;
// Texels that the filter is wide; 0 takes the nearest texel alone.
layout(constant_id = 131) const int SHADOW_WIDTH = 0;

// descriptor set 3: OmniShadowSet

// Distance of the nearest surface, metres: map by map, layer by layer, row by row.
layout(set = 3, binding = 0, scalar) restrict readonly buffer ShadowDistances { float shadow_distances[]; };

// 1 where the texel's surface is no nearer than the receiver.
float shadow_tap(ShadowReceiver r, uint map, ShadowTexel texel, int side) {
    texel = shadow_wrap(SHADOW_KIND, texel, side);
    uint layers = SHADOW_KIND == SHADOW_CUBE ? CUBE_FACES : 1u;
    uint row = (map * layers + texel.layer) * uint(side) + uint(texel.at.y);
    float seen = shadow_distances[row * uint(side) + uint(texel.at.x)];
    return seen < shadow_threshold(r, shadow_direction(SHADOW_KIND, texel, side)) ? 0.0 : 1.0;
}

// Share of the light that reaches a place on a surface. `normal`: geometric, unit, of either side; `slack`: see shadow_receiver.
float omni_shadow_visibility(uint map, int side, vec3 light, vec3 position, vec3 normal, float slack) {
    ShadowReceiver r = shadow_receiver(SHADOW_KIND, side, SHADOW_WIDTH, light, position, normal, slack);
    if (!(r.distance > 0.0)) {
        return 1.0;
    }
    ShadowTexel texel;
    vec2 place = shadow_place(SHADOW_KIND, r.to, side, texel.layer);
    if (SHADOW_WIDTH == 0) {
        texel.at = clamp(ivec2(floor(place)), ivec2(0), ivec2(side - 1));
        return shadow_tap(r, map, texel, side);
    }
    vec2 low = place - 0.5 * float(SHADOW_WIDTH);
    ivec2 first = ivec2(floor(low));
    vec2 part = low - floor(low);
    float sum = 0.0;
    for (int y = 0; y <= SHADOW_WIDTH; ++y) {
        for (int x = 0; x <= SHADOW_WIDTH; ++x) {
            float weight = shadow_weight(x, SHADOW_WIDTH, part.x) * shadow_weight(y, SHADOW_WIDTH, part.y);
            sum += weight * shadow_tap(r, map, ShadowTexel(texel.layer, first + ivec2(x, y)), side);
        }
    }
    return sum / float(SHADOW_WIDTH * SHADOW_WIDTH);
}

#endif
