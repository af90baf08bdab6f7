// Searches for what a ray meets, by a map that holds distances. Sources, bias and guarantees: maps/impostor/mod.rs; twin:
// maps/impostor/search.rs. Expects `float impostor_look_up(uint layer, vec3 l, float size)`, the length `size` of l over the distance to a layer's surface in the
// direction of l; of a length of 0 that is 0, and l any direction.
#ifndef CLERESTORY_MAPS_IMPOSTOR_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "maps/impostor_step.glsl"
#include "maps/proxy.glsl"

// What stands where there is no surface: finite, so that ratios of it are.
const float IMPOSTOR_NOTHING = 1e16;
// One over it.
const float IMPOSTOR_NOTHING_INVERSE = 1e-16;
// Layers of surfaces at most.
const uint IMPOSTOR_LAYERS_MAX = 8u;
// By how much the squared length of a direction may be off 1.
const float IMPOSTOR_UNIT = 1e-3;
// By how much, relatively, a march begins before the least distance and ends behind the greatest: surfaces between texels' centres.
const float IMPOSTOR_MARGIN = 0.05;

// Methods.
const uint IMPOSTOR_CLASSICAL = 0u;
const uint IMPOSTOR_PERPENDICULAR = 1u;
const uint IMPOSTOR_FIXED_POINT = 2u;
const uint IMPOSTOR_SECANT_FROM_POINT = 3u;
const uint IMPOSTOR_SECANT_FROM_GUESS = 4u;
const uint IMPOSTOR_FALSE_POSITION = 5u;
const uint IMPOSTOR_MIXED = 6u;
const uint IMPOSTOR_HYBRID = 7u;
const uint IMPOSTOR_MARCH = 8u;

layout(constant_id = 130) const uint IMPOSTOR_METHOD = IMPOSTOR_HYBRID;
// Steps after the first guess; intervals of a march.
layout(constant_id = 131) const uint IMPOSTOR_STEPS = 3u;
// Halvings of the interval of a crossing.
layout(constant_id = 132) const uint IMPOSTOR_BISECTIONS = 12u;
// Layers of surfaces.
layout(constant_id = 133) const uint IMPOSTOR_LAYERS = 1u;
// Whether some directions meet no surface. Where none does, the residual alone judges what a search found.
layout(constant_id = 136) const bool IMPOSTOR_IS_OPEN = true;

// What a search found: the direction from the map's place, the ray's length, |1 - g|, and the surface's layer.
struct ImpostorHit {
    vec3 direction;
    float distance;
    float residual;
    uint layer;
};

// The same as `impostor_look_up` for any l: at the map's place, where there is no direction, it looks up some. Asked is l and not its length, for which no look-up
// has to wait.
float impostor_relative(uint layer, vec3 l, float size) {
    return impostor_look_up(layer, vec3(l.xy, l == vec3(0.0) ? 1.0 : l.z), size);
}

// |x + d r| over the distance that the map has there: below 1 in front of the surface.
float impostor_ratio(uint layer, vec3 x, vec3 r, float d) {
    vec3 l = x + d * r;
    return impostor_relative(layer, l, length(l));
}

// By secants and brackets; `farthest` is the greatest distance of a surface. Steps stay loops: llvmpipe takes longer for three of them in
// a row than for four in a loop, and to compile them.
float impostor_by_steps(uint layer, vec3 x, vec3 r, float farthest) {
    float reach = length(x) + farthest;
    float far = 1.0 / impostor_look_up(layer, r, 1.0);
    float across = clamp(far - dot(r, x), 0.0, reach);
    if (IMPOSTOR_METHOD == IMPOSTOR_PERPENDICULAR) {
        return across;
    }
    float d;
    if (IMPOSTOR_METHOD == IMPOSTOR_FIXED_POINT) {
        d = min(sphere_proxy(x, r, far), reach);
        [[dont_unroll]] for (uint i = 0u; i < IMPOSTOR_STEPS; ++i) {
            vec3 l = x + d * r;
            float size = length(l);
            float g = impostor_relative(layer, l, size);
            d = min(sphere_proxy(x, r, size > 0.0 ? size / g : far), reach);
        }
        return d;
    }
    bool is_at_point = IMPOSTOR_METHOD == IMPOSTOR_SECANT_FROM_POINT || IMPOSTOR_METHOD == IMPOSTOR_FALSE_POSITION;
    float g = 0.0;
    if (is_at_point || IMPOSTOR_METHOD == IMPOSTOR_HYBRID) {
        g = impostor_ratio(layer, x, r, 0.0);
        // A point that the map's place does not see is no bracket.
        is_at_point = is_at_point || g <= 1.0;
    }
    float begin = is_at_point ? 0.0 : across;
    bool begins_in_loop = false;
    uint turns = IMPOSTOR_STEPS;
    if (IMPOSTOR_METHOD == IMPOSTOR_HYBRID) {
        // It looks its other beginning up in a turn more of the loop below, without a bracket yet: drivers that follow branches with all lanes would look it up for rays that need it not.
        begins_in_loop = !is_at_point;
        turns += uint(begins_in_loop);
    } else if (!is_at_point) {
        g = impostor_ratio(layer, x, r, begin);
    }
    vec2 last = vec2(begin, g);
    // As printed, false position takes its point for one in front.
    bool has_under = !begins_in_loop && (g < 1.0 || is_at_point);
    bool has_over = !begins_in_loop && !has_under;
    vec2 under = last;
    vec2 over = last;
    d = begins_in_loop ? begin : clamp(begin + impostor_step(last, false, last, far), 0.0, reach);
    [[dont_unroll]] for (uint i = 0u; i < turns; ++i) {
        vec2 guess = vec2(d, impostor_ratio(layer, x, r, d));
        vec2 other = last;
        bool has_other = true;
        if (IMPOSTOR_METHOD != IMPOSTOR_SECANT_FROM_POINT && IMPOSTOR_METHOD != IMPOSTOR_SECANT_FROM_GUESS) {
            bool is_under = guess.y < 1.0;
            has_other = is_under ? has_over : has_under;
            other = is_under ? over : under;
            under = is_under ? guess : under;
            over = is_under ? over : guess;
            has_under = has_under || is_under;
            has_over = has_over || !is_under;
        }
        last = guess;
        d = clamp(d + impostor_step(guess, has_other, other, far), 0.0, reach);
    }
    return d;
}

// By even steps to the first crossing whose residual is below the tolerance, and bisection; `extent` is the least and the greatest distance of a surface.
float impostor_by_march(uint layer, vec3 x, vec3 r, vec2 extent, float tolerance) {
    float begin = length(x) < extent.x ? (1.0 - IMPOSTOR_MARGIN) * sphere_proxy(x, r, extent.x) : 0.0;
    float g_low = impostor_ratio(layer, x, r, begin);
    if (begin > 0.0 && g_low >= 1.0) {
        // Between the centres of coarse texels the surface is nearer than at any of them.
        begin = 0.0;
        g_low = impostor_ratio(layer, x, r, begin);
    }
    float end = (1.0 + IMPOSTOR_MARGIN) * sphere_proxy(x, r, extent.y);
    float interval = max(end - begin, 0.0) / float(IMPOSTOR_STEPS);
    float low = begin;
    float best = end;
    float least = IMPOSTOR_NOTHING;
    bool is_found = false;
    for (uint i = 0u; i < IMPOSTOR_STEPS && !is_found; ++i) {
        float high = begin + float(i + 1u) * interval;
        float g_high = impostor_ratio(layer, x, r, high);
        bool is_under = g_low < 1.0;
        if (is_under != (g_high < 1.0)) {
            float a = low;
            float b = high;
            for (uint k = 0u; k < IMPOSTOR_BISECTIONS; ++k) {
                float middle = 0.5 * (a + b);
                bool is_before = (impostor_ratio(layer, x, r, middle) < 1.0) == is_under;
                a = is_before ? middle : a;
                b = is_before ? b : middle;
            }
            float d = 0.5 * (a + b);
            float residual = abs(1.0 - impostor_ratio(layer, x, r, d));
            is_found = residual < tolerance;
            if (residual < least) {
                best = d;
                least = residual;
            }
        }
        low = high;
        g_low = g_high;
    }
    // Beyond the farthest surface and in front of what there is: the sky.
    return !is_found && g_low < 1.0 ? end : best;
}

// Of the unit direction r; others find nothing, nor does an x as far as where there is nothing. The direction that is found has the length `size`.
ImpostorHit impostor_search(vec3 x, vec3 r, vec2 extent, float tolerance, out float size) {
    ImpostorHit best = ImpostorHit(vec3(0.0), 0.0, 1.0, 0u);
    size = 1.0;
    bool is_ray = abs(dot(r, r) - 1.0) < IMPOSTOR_UNIT && all(lessThan(abs(x), vec3(IMPOSTOR_NOTHING)));
    if (!is_ray) {
        return best;
    }
    if (IMPOSTOR_METHOD == IMPOSTOR_CLASSICAL) {
        return ImpostorHit(r, IMPOSTOR_NOTHING, 1.0, 0u);
    }
    bool is_found = false;
    for (uint layer = 0u; layer < IMPOSTOR_LAYERS; ++layer) {
        float d = IMPOSTOR_METHOD == IMPOSTOR_MARCH ? impostor_by_march(layer, x, r, extent, tolerance)
                                                    : impostor_by_steps(layer, x, r, extent.y);
        vec3 l = x + d * r;
        float squared = dot(l, l);
        float length_of_l = sqrt(squared);
        float g = impostor_relative(layer, l, length_of_l);
        bool is_sky = IMPOSTOR_IS_OPEN && squared > 0.0 && g <= IMPOSTOR_NOTHING_INVERSE * length_of_l;
        // The ray's own in the sky, and at the map's place itself, where the residual is 1.
        bool is_own = is_sky || squared == 0.0;
        ImpostorHit hit = ImpostorHit(is_own ? r : l, d, abs(1.0 - g), layer);
        if (is_sky) {
            // Seen in the first layer; in others no further surface.
            hit.distance = IMPOSTOR_NOTHING;
            hit.residual = layer == 0u ? 0.0 : 1.0;
        }
        bool is_surface = hit.residual < tolerance && hit.distance < IMPOSTOR_NOTHING && hit.distance > 0.0;
        bool is_nearer = is_surface ? !is_found || hit.distance < best.distance
                                    : !is_found && (layer == 0u || hit.residual < best.residual);
        // Of one layer it is all there is, and whoever reads no residual needs none.
        if (IMPOSTOR_LAYERS == 1u || is_nearer) {
            best = hit;
            size = is_own ? 1.0 : length_of_l;
        }
        is_found = is_found || is_surface;
    }
    return best;
}

// The same with a unit direction.
ImpostorHit impostor_search(vec3 x, vec3 r, vec2 extent, float tolerance) {
    float size;
    ImpostorHit hit = impostor_search(x, r, extent, tolerance, size);
    hit.direction *= 1.0 / size;
    return hit;
}

#endif
