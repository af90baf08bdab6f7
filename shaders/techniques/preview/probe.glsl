// Light from a directional map whose levels are filtered by ever wider GGX lobes, down to the cosine. Sources, bias and guarantees:
// techniques/preview/probe.rs. Expects what transport/bsdf.glsl expects.
#ifndef CLERESTORY_TECHNIQUES_PREVIEW_PROBE_GLSL
#define CLERESTORY_TECHNIQUES_PREVIEW_PROBE_GLSL

#include "maps/directional_map_set.glsl"
#include "transport/microfacet_albedo.glsl"

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

#endif
