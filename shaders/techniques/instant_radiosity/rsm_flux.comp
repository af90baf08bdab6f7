#version 460
// The texels of an emitter's view: what their light meets, the power that arrives there, by the exact solid angle of the texel, and, for choosing among texels, the
// luminance that goes on from there.
//
// SVO-P8: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", 2005. Deterministic.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "transport/features.glsl"
#include "accel/index_rays.glsl"
#include "invocation.glsl"
#include "finite.glsl"
#include "raster/atlas_level.glsl"
#include "raster/reflective.glsl"
#include "techniques/instant_radiosity/new_virtual_light.glsl"
#include "techniques/instant_radiosity/rsm.glsl"
#include "transport/environment.glsl"

layout(push_constant, scalar) uniform Push {
    vec3 scene_lower;
    uint view;
    vec3 scene_upper;
} push;

layout(set = 0, binding = 0) uniform usampler2D seen_triangles;
layout(set = 0, binding = 1) uniform sampler2D seen_weights;
layout(set = 0, binding = 2, scalar) restrict readonly buffer RsmEmitters { RsmEmitter rsm_emitters[]; };
layout(set = 0, binding = 3, scalar) restrict readonly buffer RsmViews { RsmView rsm_views[]; };
layout(set = 0, binding = 4, scalar) restrict writeonly buffer RsmTexels { RsmTexel rsm_texels[]; };
layout(set = 0, binding = 5, scalar) restrict writeonly buffer FluxSums { float flux_sums[]; };

// Steradians that a pixel spans; of parallel rays square metres.
float pixel_extent(SeenFrom seen, uvec2 pixel) {
    vec2 halves = vec2(length(seen.right), length(seen.down));
    vec2 size = vec2(seen.width, seen.height);
    vec2 lower = (2.0 * vec2(pixel) / size - 1.0) * halves;
    vec2 width = 2.0 / size * halves;
    return seen.is_parallel != 0u ? width.x * width.y : rsm_solid_angle(lower, lower + width);
}

void main() {
    uint index = invocation_index();
    RsmView view = rsm_views[push.view];
    uint side = view.seen.width;
    if (index >= side * side) {
        return;
    }
    uvec2 pixel = uvec2(index % side, index / side);
    RsmTexel texel;
    texel.triangle = texelFetch(seen_triangles, ivec2(pixel), 0).x;
    texel.weights = texelFetch(seen_weights, ivec2(pixel), 0).xy;
    texel.power = vec3(0.0);
    float luminance = 0.0;
    if (texel.triangle != NO_HIT) {
        vec3 origin;
        vec3 direction = seen_direction(view.seen, pixel, origin);
        Arrival a = arrival_at(Hit(0.0, texel.weights, texel.triangle), direction, push.scene_lower, push.scene_upper);
        vec3 power = finite_or_black(rsm_intensity(rsm_emitters[view.emitter], direction) * pixel_extent(view.seen, pixel));
        if (view.seen.is_parallel == 0u) {
            power = absorbed(power, arrival_interior(a, OUTSIDE), distance(origin, a.surface.point.position));
        }
        vec3 reflected = LAMBERT ? power * cosine_lobes(a.bsdf, 1.0, false, LOBE_DIFFUSE).diffuse : power;
        luminance = arrival_has_rough_lobes(a) ? dot(reflected, LUMINANCE.rgb) : 0.0;
        texel.power = luminance > 0.0 ? power : vec3(0.0);
    }
    uint place = push.view * side * side + index;
    rsm_texels[place] = texel;
    flux_sums[place] = luminance;
}
