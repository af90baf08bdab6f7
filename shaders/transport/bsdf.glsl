// The surface scattering function: glTF 2.0 metallic-roughness with transmission, exact conductors, and the modified Phong model.
//
// f = m f_metal + (1 - m) (f_layer + (1 - t) f_diffuse + t f_transmission), m = metallic, t = transmission.
//   f_layer         GGX reflection under the exact dielectric Fresnel factor, tinted as KHR_materials_specular asks
//   f_diffuse       base colour (1 - E(wo)) (1 - E(wi)) / (pi (1 - E_avg)), E the albedo of f_layer: reciprocal, and a white base
//                   gives back all that the layer lets through (Kelemen and Szirmay-Kalos 2001; Shirley et al. 1997)
//   f_transmission  Walter et al. (2007) through solids, with radiance scaled by 1/eta^2; mirrored GGX lobe through thin walls
//   f_metal         GGX with Schlick's or a conductor's Fresnel factor, exact or in the form that it names, plus the lobe of Kulla and Conty (2017); or base colour times the
//                  modified Phong lobe, for surfaces without layer and transmission; or classical microfacets (transport/microfacets.glsl)
// Guarantees: never gains energy beyond the interpolation error of the albedo table (stated in bsdf.rs's tests); reflection is
// reciprocal, transmission up to eta^2; specular 0 without transmission and metal is exactly Lambert. From inside a solid
// (wo.z < 0) the diffuse base is black: what glTF calls its opaque part absorbs.
// Frame: z is the shading normal; of a solid it points out of the body. Opaque and thin surfaces scatter alike on both sides.
// Expects, declared before the inclusion: bool constants HAS_METAL, HAS_EXACT_CONDUCTOR, HAS_SCHLICK_CONDUCTOR, HAS_COMPENSATED_CONDUCTOR,
// HAS_TINTED_CONDUCTOR, HAS_SIMPLIFIED_CONDUCTOR, HAS_TABLE_CONDUCTOR, HAS_CLASSIC_MICROFACETS, HAS_PHONG, HAS_SPECULAR_LAYER,
// HAS_TRANSMISSION, HAS_MULTIPLE_SCATTERING, SEPARABLE_MASKING; `float albedo_table(uint)`, read only if HAS_SPECULAR_LAYER or
// HAS_MULTIPLE_SCATTERING; `vec4 fresnel_table(uint)`, read only if HAS_TABLE_CONDUCTOR.
#ifndef CLERESTORY_TRANSPORT_BSDF_GLSL
#define CLERESTORY_TRANSPORT_BSDF_GLSL

#include "transport/albedo.glsl"
#include "transport/choice.glsl"
#include "transport/fresnel.glsl"
#include "transport/fresnel_forms.glsl"
#include "transport/fresnel_table.glsl"
#include "transport/ggx.glsl"
#include "transport/microfacets.glsl"
#include "transport/phong.glsl"
#include "transport/warp.glsl"

// Sets of lobes, a bit each. A lobe is what a class and a side have in common: LOBE_GLOSSY & LOBE_REFLECTION. BsdfSample.flags holds
// the one that was sampled.
const uint LOBE_DIFFUSE = 3u;
const uint LOBE_GLOSSY = 12u;
const uint LOBE_SPECULAR = 48u;
const uint LOBE_REFLECTION = 21u;
const uint LOBE_TRANSMISSION = 42u;
const uint LOBE_ALL = 63u;

const uint BSDF_THIN = 1u;        // transmission goes straight through a thin wall
const uint BSDF_EXACT_CONDUCTOR = 2u;  // the metal is conductor_a + i conductor_b, not base_color
const uint BSDF_IMPORTANCE = 4u;  // wo is where particles come from: no 1/eta^2
const uint BSDF_PHONG = 8u;       // the metal is a modified Phong lobe of reflectance base_color
// The metal is a conductor in another form than the exact one: what stands in conductor_a and conductor_b.
const uint BSDF_SCHLICK_CONDUCTOR = 16u;      // F0
const uint BSDF_COMPENSATED_CONDUCTOR = 32u;  // F0 and a, with the exponents in conductor_c
const uint BSDF_TINTED_CONDUCTOR = 64u;       // F0 and b
const uint BSDF_SIMPLIFIED_CONDUCTOR = 128u;  // eta and k
// The metal's microfacets are not GGX's with Smith's masking, and are not compensated for multiple scattering: GGX's, Beckmann's or a cosine lobe, with the
// geometric term of Cook and Torrance, the simplified one or Smith's.
const uint BSDF_CLASSIC = 256u;
const uint BSDF_BECKMANN = 512u;
const uint BSDF_COSINE_LOBE = 1024u;
const uint BSDF_SIMPLIFIED_G = 2048u;
const uint BSDF_SMITH_G = 4096u;
const uint BSDF_TABLE_CONDUCTOR = 8192u;  // the metal is a conductor by a table, whose number stands in the first band of conductor_a
const uint BSDF_CLASSIC_FLAGS = BSDF_CLASSIC | BSDF_BECKMANN | BSDF_COSINE_LOBE | BSDF_SIMPLIFIED_G | BSDF_SMITH_G;

// A rough solid whose index is that of its surroundings has no defined half vector: it is given this index.
const float ETA_MATCHED = 1.001;
// Below this 1 - E_avg there is no multiple scattering to speak of.
const float LOSS_MIN = 1e-5;

struct Bsdf {
    vec3 base_color;
    float metallic;
    vec3 specular_f0;      // normal reflectance of the layer: min(F0(eta) specular_color, 1)
    float specular;
    vec3 conductor_a;
    float alpha;           // GGX width, which stands for a Phong exponent too; a mirror below ALPHA_MIN
    vec3 conductor_b;
    float transmission;
    vec3 conductor_c;      // cosine-weighted average of the conductor's factor, or an exponent
    float eta;             // index inside / outside; 0 stands for Schlick's factor
    uint flags;
};

struct BsdfSample {
    vec3 wi;
    float pdf;     // solid angle; 0 for a delta lobe
    float choice;  // probability that this delta lobe was chosen; 1 for others, whose density has it
    vec3 weight;   // f |cos| / pdf, all probabilities included
    uint flags;    // the lobe; 0 when no direction was found: the path ends
};

float mean3(vec3 v) { return (v.x + v.y + v.z) * (1.0 / 3.0); }
bool lobe_allowed(uint mask, uint lobe) { return (mask & lobe) != 0u; }
bool bsdf_is_delta(Bsdf b) { return b.alpha < ALPHA_MIN; }
bool bsdf_is_phong(Bsdf b) { return HAS_PHONG && (b.flags & BSDF_PHONG) != 0u; }
bool bsdf_is_classic(Bsdf b) { return HAS_CLASSIC_MICROFACETS && (b.flags & BSDF_CLASSIC) != 0u && !bsdf_is_delta(b); }
float bsdf_metallic(Bsdf b) { return HAS_METAL ? b.metallic : 0.0; }
float bsdf_transmission(Bsdf b) { return HAS_TRANSMISSION ? b.transmission : 0.0; }

// The parameters that glTF's factors stand for. `thickness` > 0 bounds a solid.
Bsdf bsdf_gltf(vec3 base_color, float metallic, float roughness, float transmission, float ior, float specular,
               vec3 specular_color, float thickness) {
    Bsdf b;
    b.base_color = clamp(base_color, vec3(0.0), vec3(1.0));
    b.metallic = clamp(metallic, 0.0, 1.0);
    b.alpha = clamp(roughness * roughness, 0.0, 1.0);
    b.eta = ior <= 0.0 ? 0.0 : max(ior, 1.0);
    // An infinite index lets nothing in.
    b.transmission = ior <= 0.0 ? 0.0 : clamp(transmission, 0.0, 1.0);
    b.specular = clamp(specular, 0.0, 1.0);
    b.specular_f0 = clamp(fresnel_f0(b.eta) * specular_color, vec3(0.0), vec3(1.0));
    b.conductor_a = vec3(1.0);
    b.conductor_b = vec3(0.0);
    b.conductor_c = vec3(0.0);
    b.flags = thickness > 0.0 ? 0u : BSDF_THIN;
    if (thickness > 0.0 && b.transmission > 0.0 && b.alpha >= ALPHA_MIN) {
        b.eta = max(b.eta, ETA_MATCHED);
    }
    return b;
}

// Reflectance of the dielectric layer; eta is that beyond over that on the side of wo.
vec3 layer_fresnel(Bsdf b, float cos_h, float eta) {
    if (b.eta <= 0.0) {
        return HAS_SPECULAR_LAYER ? b.specular * fresnel_schlick(cos_h, b.specular_f0) : vec3(0.0);
    }
    if (HAS_TRANSMISSION && eta * eta - 1.0 + cos_h * cos_h <= 0.0) {
        return vec3(1.0);
    }
    if (!HAS_SPECULAR_LAYER) {
        return vec3(0.0);
    }
    float f = fresnel_dielectric(cos_h, eta);
    float f0 = fresnel_f0(eta);
    // F where specular_f0 = F0; unit reflectance at grazing incidence whatever the tint.
    return b.specular * max(f + (b.specular_f0 - f0) * ((1.0 - f) / (1.0 - f0)), vec3(0.0));
}

vec3 metal_fresnel(Bsdf b, float cos_h) {
    if (bsdf_is_phong(b)) {
        return b.base_color;
    }
    if (HAS_EXACT_CONDUCTOR && (b.flags & BSDF_EXACT_CONDUCTOR) != 0u) {
        return fresnel_conductor(cos_h, b.conductor_a, b.conductor_b);
    }
    if (HAS_SCHLICK_CONDUCTOR && (b.flags & BSDF_SCHLICK_CONDUCTOR) != 0u) {
        return fresnel_schlick(cos_h, b.conductor_a);
    }
    if (HAS_COMPENSATED_CONDUCTOR && (b.flags & BSDF_COMPENSATED_CONDUCTOR) != 0u) {
        return fresnel_compensated(cos_h, b.conductor_a, b.conductor_b, b.conductor_c);
    }
    if (HAS_TINTED_CONDUCTOR && (b.flags & BSDF_TINTED_CONDUCTOR) != 0u) {
        return fresnel_tinted(cos_h, b.conductor_a, b.conductor_b);
    }
    if (HAS_SIMPLIFIED_CONDUCTOR && (b.flags & BSDF_SIMPLIFIED_CONDUCTOR) != 0u) {
        return fresnel_simplified(cos_h, b.conductor_a, b.conductor_b);
    }
    if (HAS_TABLE_CONDUCTOR && (b.flags & BSDF_TABLE_CONDUCTOR) != 0u) {
        return fresnel_tabulated(uint(b.conductor_a.x), cos_h);
    }
    return fresnel_schlick(cos_h, b.base_color);
}

float classic_d(Bsdf b, vec3 h) {
    if ((b.flags & BSDF_BECKMANN) != 0u) {
        return beckmann_d(h, b.alpha);
    }
    return (b.flags & BSDF_COSINE_LOBE) != 0u ? cosine_lobe_d(h, cosine_lobe_exponent(b.alpha)) : ggx_d(h, b.alpha);
}

// Smith's masking of one direction.
float classic_g1(Bsdf b, vec3 w) {
    if ((b.flags & BSDF_BECKMANN) != 0u) {
        return beckmann_g1(w, b.alpha);
    }
    return (b.flags & BSDF_COSINE_LOBE) != 0u ? cosine_lobe_g1(w, cosine_lobe_exponent(b.alpha)) : ggx_g1(w.z, b.alpha);
}

// The geometric term, over 4 (n.wi) (n.wo).
float classic_g(Bsdf b, vec3 wo, vec3 wi, vec3 h) {
    if ((b.flags & BSDF_SIMPLIFIED_G) != 0u) {
        return kelemen_g(wi, h);
    }
    if ((b.flags & BSDF_SMITH_G) != 0u) {
        return smith_g(wi, wo, classic_g1(b, wi), classic_g1(b, wo));
    }
    return cook_torrance_g(wi, wo, h);
}

// Normals of GGX are those that are visible, others those by their density times their cosine.
vec3 classic_sample(Bsdf b, vec3 wo, vec2 u) {
    if ((b.flags & BSDF_BECKMANN) != 0u) {
        return beckmann_sample(b.alpha, u);
    }
    return (b.flags & BSDF_COSINE_LOBE) != 0u ? cosine_lobe_sample(cosine_lobe_exponent(b.alpha), u)
                                              : ggx_sample_visible(wo, b.alpha, u);
}

// f cos (rgb) of a classic metal, and the density of the directions that its normals reflect (a); wo.z and wi.z > 0.
vec4 classic_eval(Bsdf b, vec3 wo, vec3 wi) {
    vec3 h = normalize(wo + wi);
    float cos_h = dot(wo, h);
    if (cos_h <= 0.0 || h.z <= 0.0) {
        return vec4(0.0);
    }
    float d = classic_d(b, h);
    bool by_cosine = (b.flags & (BSDF_BECKMANN | BSDF_COSINE_LOBE)) != 0u;
    float normals = by_cosine ? d * h.z : ggx_visible_pdf(wo, h, b.alpha);
    float g = classic_g(b, wo, wi, h);
    return vec4(metal_fresnel(b, cos_h) * (d * g * wi.z), normals / (4.0 * cos_h));
}

// The flags of the conductors that are compiled in.
uint conductor_flags() {
    return (HAS_EXACT_CONDUCTOR ? BSDF_EXACT_CONDUCTOR : 0u) | (HAS_SCHLICK_CONDUCTOR ? BSDF_SCHLICK_CONDUCTOR : 0u)
        | (HAS_COMPENSATED_CONDUCTOR ? BSDF_COMPENSATED_CONDUCTOR : 0u) | (HAS_TINTED_CONDUCTOR ? BSDF_TINTED_CONDUCTOR : 0u)
        | (HAS_SIMPLIFIED_CONDUCTOR ? BSDF_SIMPLIFIED_CONDUCTOR : 0u) | (HAS_TABLE_CONDUCTOR ? BSDF_TABLE_CONDUCTOR : 0u);
}

// Whether the metal is a conductor by its index, in any form, not of a base colour.
bool bsdf_is_conductor(Bsdf b) { return (b.flags & conductor_flags()) != 0u; }

// Cosine-weighted hemispherical average of a conductor's factor.
vec3 conductor_average(Bsdf b) {
    return HAS_COMPENSATED_CONDUCTOR && (b.flags & BSDF_COMPENSATED_CONDUCTOR) != 0u
        ? fresnel_compensated_average(b.conductor_a, b.conductor_b, b.conductor_c)
        : b.conductor_c;
}

// What the layer reflects of a microfacet (r) and what goes through it (t), as the mask allows.
void microfacet_split(Bsdf b, float cos_h, float eta, uint mask, out vec3 r, out vec3 t) {
    uint shape = bsdf_is_delta(b) ? LOBE_SPECULAR : LOBE_GLOSSY;
    vec3 f = layer_fresnel(b, cos_h, eta);
    float m = bsdf_metallic(b);
    r = (1.0 - m) * f;
    if (HAS_METAL) {
        r += m * metal_fresnel(b, cos_h);
    }
    t = ((1.0 - m) * bsdf_transmission(b)) * b.base_color * (1.0 - f);
    if (!lobe_allowed(mask, shape & LOBE_REFLECTION)) {
        r = vec3(0.0);
    }
    if (!HAS_TRANSMISSION || !lobe_allowed(mask, shape & LOBE_TRANSMISSION)) {
        t = vec3(0.0);
    }
}

// Probability of reflection at a microfacet.
float reflection_probability(vec3 r, vec3 t) {
    float total = mean3(r) + mean3(t);
    return total > 0.0 ? mean3(r) / total : 1.0;
}

// One minus the albedo of the layer, towards one direction or (cos_theta < 0) averaged.
vec3 layer_loss(Bsdf b, float cos_theta) {
    if (!HAS_SPECULAR_LAYER) {
        return vec3(1.0);
    }
    float w;
    uint layer = albedo_layer(b.eta, w);
    vec3 e = cos_theta < 0.0
        ? vec3(albedo_average(0u, b.alpha), albedo_average(layer, b.alpha), albedo_average(layer + 1u, b.alpha))
        : vec3(albedo_lookup(0u, cos_theta, b.alpha), albedo_lookup(layer, cos_theta, b.alpha),
               albedo_lookup(layer + 1u, cos_theta, b.alpha));
    return 1.0 - b.specular * (b.specular_f0 * e.x + (1.0 - b.specular_f0) * mix(e.y, e.z, w));
}

// Reflectances of the two lobes that are sampled by the cosine: the diffuse base and the metal's multiple scattering.
// `seen` is their albedo towards wo.
struct CosineLobes {
    vec3 diffuse;
    vec3 metal;
    vec3 seen;
};

// Whether there is a diffuse base to scatter light from wo; `below`: wo.z < 0.
bool bsdf_has_diffuse_base(Bsdf b, bool below) {
    bool inside = HAS_TRANSMISSION && below && b.transmission > 0.0 && (b.flags & BSDF_THIN) == 0u;
    return !inside && (1.0 - bsdf_metallic(b)) * (1.0 - bsdf_transmission(b)) > 0.0 && b.base_color != vec3(0.0);
}

CosineLobes cosine_lobes(Bsdf b, float cos_o, bool inside, uint mask) {
    CosineLobes lobes;
    lobes.diffuse = vec3(0.0);
    lobes.metal = vec3(0.0);
    float m = bsdf_metallic(b);
    float opaque = (1.0 - m) * (1.0 - bsdf_transmission(b));
    if (opaque > 0.0 && !inside && lobe_allowed(mask, LOBE_DIFFUSE & LOBE_REFLECTION)) {
        lobes.diffuse = opaque * b.base_color * layer_loss(b, cos_o);
    }
    lobes.seen = lobes.diffuse;
    if (HAS_METAL && HAS_MULTIPLE_SCATTERING && !bsdf_is_delta(b) && !bsdf_is_phong(b) && !bsdf_is_classic(b) && lobe_allowed(mask, LOBE_GLOSSY & LOBE_REFLECTION)) {
        float e_average = albedo_average(0u, b.alpha);
        float loss = 1.0 - e_average;
        if (loss > LOSS_MIN) {
            // 1/21 = 2 int (1 - mu)^5 mu dmu
            vec3 f = bsdf_is_conductor(b) ? conductor_average(b) : mix(b.base_color, vec3(1.0), 1.0 / 21.0);
            lobes.metal = m * f * f * e_average / (1.0 - f * loss) * (1.0 - albedo_lookup(0u, cos_o, b.alpha));
            lobes.seen += lobes.metal;
        }
    }
    return lobes;
}

// f of the cosine-sampled lobes towards a direction at cos_i > 0.
vec3 cosine_lobes_eval(Bsdf b, CosineLobes lobes, float cos_i) {
    vec3 f = lobes.diffuse;
    if (HAS_SPECULAR_LAYER && lobes.diffuse != vec3(0.0)) {
        f *= layer_loss(b, cos_i) / max(layer_loss(b, -1.0), vec3(LOSS_MIN));
    }
    if (HAS_METAL && HAS_MULTIPLE_SCATTERING && lobes.metal != vec3(0.0)) {
        f += lobes.metal * ((1.0 - albedo_lookup(0u, cos_i, b.alpha)) / (1.0 - albedo_average(0u, b.alpha)));
    }
    return f * INV_PI;
}

// Probability of the cosine strategy: its share of the albedo, with the microfacets taken at the macrosurface's angle.
float cosine_probability(Bsdf b, CosineLobes lobes, float cos_o, float eta, uint mask) {
    vec3 r;
    vec3 t;
    microfacet_split(b, cos_o, eta, mask, r, t);
    float d = mean3(lobes.seen);
    float s = mean3(r) + mean3(t);
    return d > 0.0 ? d / (d + s) : 0.0;
}

// Radiance scaling of a refraction.
float refraction_scale(Bsdf b, float eta) { return (b.flags & BSDF_IMPORTANCE) != 0u ? 1.0 : 1.0 / (eta * eta); }

// Non-delta lobes for wo.z > 0: f |cos| of those in `part` in rgb, density in a. `lobes` holds what `part` has of them.
vec4 bsdf_eval_upper(Bsdf b, CosineLobes lobes, float p_cosine, vec3 wo, vec3 wi, float eta, uint mask, uint part) {
    vec4 result = vec4(0.0);
    bool reflected = wi.z > 0.0;
    float cos_i = abs(wi.z);
    if (cos_i <= 0.0 || wo.z <= 0.0) {
        return result;
    }
    if (reflected) {
        result = vec4(cosine_lobes_eval(b, lobes, cos_i) * cos_i, p_cosine * cosine_hemisphere_pdf(cos_i));
    }
    if (bsdf_is_phong(b) && !bsdf_is_delta(b)) {
        if (reflected) {
            float exponent = phong_exponent(b.alpha);
            float m = lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION) ? bsdf_metallic(b) : 0.0;
            result += vec4(phong_eval(m * b.base_color, exponent, wo, wi), (1.0 - p_cosine) * phong_pdf(exponent, wo, wi));
        }
        return result;
    }
    if (bsdf_is_classic(b)) {
        if (reflected) {
            vec4 classic = classic_eval(b, wo, wi);
            float m = lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION) ? bsdf_metallic(b) : 0.0;
            result += vec4(m * classic.rgb, (1.0 - p_cosine) * classic.a);
        }
        return result;
    }
    bool microfacets = HAS_METAL || HAS_SPECULAR_LAYER || HAS_TRANSMISSION;
    if (!microfacets || bsdf_is_delta(b) || !(reflected || bsdf_transmission(b) > 0.0)) {
        return result;
    }
    bool refracted = HAS_TRANSMISSION && !reflected && (b.flags & BSDF_THIN) == 0u;
    vec3 h = refracted ? -(wo + eta * wi) : wo + vec3(wi.xy, cos_i);
    h = normalize(h.z < 0.0 ? -h : h);
    float cos_h = dot(wo, h);
    float cos_ih = dot(wi, h);
    if (cos_h <= 0.0 || (refracted && cos_ih >= 0.0)) {
        return result;
    }
    vec3 r;
    vec3 t;
    microfacet_split(b, cos_h, eta, mask, r, t);
    float p_reflection = reflection_probability(r, t);
    if (!lobe_allowed(part, LOBE_GLOSSY & (reflected ? LOBE_REFLECTION : LOBE_TRANSMISSION))) {
        r = vec3(0.0);
        t = vec3(0.0);
    }
    float density = (1.0 - p_cosine) * ggx_visible_pdf(wo, h, b.alpha) * (reflected ? p_reflection : 1.0 - p_reflection);
    float d = ggx_d(h, b.alpha);
    if (refracted) {
        float q = cos_h + eta * cos_ih;
        float jacobian = -cos_ih * eta * eta / (q * q);
        float masking = ggx_g1(wo.z, b.alpha) * ggx_g1(cos_i, b.alpha);
        return vec4(t * (d * masking * cos_h / wo.z * jacobian * refraction_scale(b, eta)), density * jacobian);
    }
    float shape = d * ggx_g2(wo.z, cos_i, b.alpha) / (4.0 * wo.z);
    return result + vec4((reflected ? r : t) * shape, density / (4.0 * cos_h));
}

// f |cos| (rgb) of the lobes in `part`, a subset of `mask`, and the density of bsdf_sample (a) under `mask`; without deltas.
vec4 bsdf_eval_part(Bsdf b, vec3 wo, vec3 wi, uint mask, uint part) {
    bool below = wo.z < 0.0;
    bool inside = HAS_TRANSMISSION && below && b.transmission > 0.0 && (b.flags & BSDF_THIN) == 0u;
    if (below) {
        wo.z = -wo.z;
        wi.z = -wi.z;
    }
    float eta = inside ? 1.0 / b.eta : b.eta;
    CosineLobes lobes = cosine_lobes(b, wo.z, inside, mask);
    float p_cosine = cosine_probability(b, lobes, wo.z, eta, mask);
    if (!lobe_allowed(part, LOBE_DIFFUSE & LOBE_REFLECTION)) {
        lobes.diffuse = vec3(0.0);
    }
    if (!lobe_allowed(part, LOBE_GLOSSY & LOBE_REFLECTION)) {
        lobes.metal = vec3(0.0);
    }
    return bsdf_eval_upper(b, lobes, p_cosine, wo, wi, eta, mask, part);
}

// f |cos| (rgb) and the density of bsdf_sample (a) of all allowed lobes that are not deltas.
vec4 bsdf_eval_pdf(Bsdf b, vec3 wo, vec3 wi, uint mask) { return bsdf_eval_part(b, wo, wi, mask, mask); }

vec3 bsdf_eval(Bsdf b, vec3 wo, vec3 wi, uint mask) { return bsdf_eval_pdf(b, wo, wi, mask).rgb; }

// `u.xy` choose the lobe and the direction, `u.z` between the two sides of a rough microfacet.
BsdfSample bsdf_sample(Bsdf b, vec3 wo, vec3 u, uint mask) {
    BsdfSample s = BsdfSample(vec3(0.0), 0.0, 1.0, vec3(0.0), 0u);
    bool below = wo.z < 0.0;
    bool inside = HAS_TRANSMISSION && below && b.transmission > 0.0 && (b.flags & BSDF_THIN) == 0u;
    float side = below ? -1.0 : 1.0;
    wo.z = abs(wo.z);
    float eta = inside ? 1.0 / b.eta : b.eta;
    CosineLobes lobes = cosine_lobes(b, wo.z, inside, mask);
    float p_cosine = cosine_probability(b, lobes, wo.z, eta, mask);
    vec3 wi;
    uint flags;
    if (choose_first(u.x, p_cosine)) {
        wi = square_to_cosine_hemisphere(u.xy);
        flags = LOBE_DIFFUSE & LOBE_REFLECTION;
    } else if (bsdf_is_phong(b) && !bsdf_is_delta(b)) {
        wi = phong_sample(phong_exponent(b.alpha), wo, u.xy);
        flags = LOBE_GLOSSY & LOBE_REFLECTION;
    } else if (bsdf_is_classic(b)) {
        vec3 h = classic_sample(b, wo, u.xy);
        wi = 2.0 * dot(wo, h) * h - wo;
        flags = LOBE_GLOSSY & LOBE_REFLECTION;
    } else {
        bool delta = bsdf_is_delta(b);
        vec3 h = delta ? vec3(0.0, 0.0, 1.0) : ggx_sample_visible(wo, b.alpha, u.xy);
        float cos_h = dot(wo, h);
        vec3 r;
        vec3 t;
        microfacet_split(b, cos_h, eta, mask, r, t);
        float p_reflection = reflection_probability(r, t);
        // A delta leaves the number over that chose it.
        bool reflected = (delta ? u.x : u.z) < p_reflection;
        wi = 2.0 * cos_h * h - wo;
        uint shape = delta ? LOBE_SPECULAR : LOBE_GLOSSY;
        flags = shape & LOBE_REFLECTION;
        float choice = p_reflection * (1.0 - p_cosine);
        float scale = 1.0 / choice;
        if (wi.z <= 0.0 && (reflected || (b.flags & BSDF_THIN) != 0u)) {
            return s;
        }
        if (HAS_TRANSMISSION && !reflected) {
            flags = shape & LOBE_TRANSMISSION;
            choice = (1.0 - p_reflection) * (1.0 - p_cosine);
            scale = 1.0 / choice;
            if ((b.flags & BSDF_THIN) != 0u) {
                wi.z = -wi.z;
            } else {
                float inv = 1.0 / eta;
                float cos_t = sqrt(max(0.0, 1.0 - (1.0 - cos_h * cos_h) * inv * inv));
                wi = (cos_h * inv - cos_t) * h - inv * wo;
                scale *= refraction_scale(b, eta);
                if (wi.z >= 0.0) {
                    return s;
                }
            }
        }
        if (delta) {
            s.choice = choice;
            s.weight = (reflected ? r : t) * scale;
            s.wi = vec3(wi.xy, wi.z * side);
            s.flags = s.weight == vec3(0.0) ? 0u : flags;
            return s;
        }
    }
    vec4 f = bsdf_eval_upper(b, lobes, p_cosine, wo, wi, eta, mask, mask);
    if (f.a <= 0.0) {
        return s;
    }
    s.wi = vec3(wi.xy, wi.z * side);
    s.pdf = f.a;
    s.weight = f.rgb / f.a;
    s.flags = flags;
    return s;
}

#endif
