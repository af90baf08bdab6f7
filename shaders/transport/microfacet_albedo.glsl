// Albedo of microfacets, for light that is looked up and not sampled. Sources: transport/albedo.rs. Expects what transport/bsdf.glsl expects.
#ifndef CLERESTORY_TRANSPORT_MICROFACET_ALBEDO_GLSL
#define CLERESTORY_TRANSPORT_MICROFACET_ALBEDO_GLSL

#include "transport/bsdf.glsl"

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
