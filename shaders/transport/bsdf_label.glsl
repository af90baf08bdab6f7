// Which lobe a sampled direction counts as, where what follows depends on it.
//
// Strategies overlap: a direction found by the cosine may be the microfacets' light as well. A label is drawn in proportion to what the
// lobes scatter that way, and the weight is that lobe's share over the label's probability: unbiased for each label, and the sum over
// labels has the weight that it had (a discrete choice inside one-sample estimation; Veach 1997, 2.5 and 9.2.4).
#ifndef CLERESTORY_TRANSPORT_BSDF_LABEL_GLSL
#define CLERESTORY_TRANSPORT_BSDF_LABEL_GLSL

#include "transport/bsdf.glsl"

// Keeps a quotient of zeros zero.
const float LABEL_LEAST = 1e-37;

// A sample with its label, one of the lobes of the mask that it was drawn with. `alike`: the base and the microfacets' reflection need not
// be told apart. `u` is used and, for further use, made uniform again.
BsdfSample bsdf_label(Bsdf b, vec3 wo, BsdfSample s, uint mask, bool alike, inout float u) {
    const uint base = LOBE_DIFFUSE & LOBE_REFLECTION;
    const uint microfacets = LOBE_GLOSSY & LOBE_REFLECTION;
    if (s.pdf <= 0.0 || (s.flags & (base | microfacets)) == 0u) {
        return s;
    }
    if (!lobe_allowed(mask, s.flags)) {
        // The metal's compensation is sampled as the base is.
        s.flags ^= base | microfacets;
    }
    if (alike || !lobe_allowed(mask, base) || !lobe_allowed(mask, microfacets)) {
        return s;
    }
    vec3 whole = s.weight * s.pdf;
    vec3 diffuse = min(bsdf_eval(b, wo, s.wi, base), whole);
    vec3 glossy = whole - diffuse;
    float d = max(diffuse.x, max(diffuse.y, diffuse.z));
    float g = max(glossy.x, max(glossy.y, glossy.z));
    float p = d / max(d + g, LABEL_LEAST);
    bool chosen = choose_first(u, p);
    float share = chosen ? p : 1.0 - p;
    s.flags = chosen ? base : microfacets;
    s.weight = (chosen ? diffuse : glossy) / (s.pdf * share);
    return s;
}

#endif
