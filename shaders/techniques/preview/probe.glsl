// Light from a directional map whose levels are filtered by ever wider GGX lobes, down to the cosine. Sources, bias and guarantees:
// techniques/preview/probe.rs. Expects what transport/bsdf.glsl expects.
#ifndef CLERESTORY_TECHNIQUES_PREVIEW_PROBE_GLSL
#define CLERESTORY_TECHNIQUES_PREVIEW_PROBE_GLSL

#include "maps/directional_map_set.glsl"
#include "transport/bsdf.glsl"

// Levels that a probe may have.
const uint PROBE_LEVELS_MAX = 8u;

// Between two levels of lobe widths 0 < a < b: the share of the second in the mixture whose lobe is nearest to that of width alpha.
float probe_part(float alpha, float a, float b) {
    if (alpha <= a) {
        return 0.0;
    }
    float x = alpha * alpha;
    a *= a;
    b *= b;
    return min(log((x + a) * (a + b) / (2.0 * a * (x + b))) / log((a + b) * (a + b) / (4.0 * a * b)), 1.0);
}

// Albedo of the reflection by microfacets towards a direction at cos_o, in one reflection.
vec3 microfacet_albedo(Bsdf b, float cos_o) {
    float m = bsdf_metallic(b);
    vec3 albedo = vec3(0.0);
    if (HAS_SPECULAR_LAYER && m < 1.0) {
        albedo = (1.0 - m) * (1.0 - layer_loss(b, cos_o));
    }
    if (HAS_METAL && m > 0.0) {
        if (bsdf_is_delta(b)) {
            albedo += m * metal_fresnel(b, cos_o);
        } else {
            vec3 f0 = metal_fresnel(b, 1.0);
            albedo += m * mix(vec3(albedo_lookup(SCHLICK_LAYER, cos_o, b.alpha)), vec3(albedo_lookup(0u, cos_o, b.alpha)), f0);
        }
    }
    return albedo;
}

#endif
