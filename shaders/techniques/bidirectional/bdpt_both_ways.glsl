// Scattering at a vertex for subpaths from both ends.
//
// What light is scattered is that which eye paths see, from whichever end a subpath comes: the shading frame is the eye's. So all ways to make a path have the
// same integrand, where normals are interpolated, too (Veach 1997, 5.3). Densities are those of the walk from the side named, in the frame that it has there.
// Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_BOTH_WAYS_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_BOTH_WAYS_GLSL

#include "finite.glsl"
#include "techniques/bidirectional/bdpt_mis.glsl"
#include "transport/arrival.glsl"

// The same point for a way that comes from `wo`.
Arrival arrival_from(Arrival a, vec3 wo) {
    a.wo = wo;
    a.front = dot(wo, a.surface.geometric_normal) > 0.0;
    a.facing = a.front ? a.surface.geometric_normal : -a.surface.geometric_normal;
    return a;
}

// Cosine to the geometric normal, for densities per area.
float surface_cos(Arrival a, vec3 w) { return max(abs(dot(w, a.surface.geometric_normal)), MIS_COS_MIN); }

// f |cos| of light from wi to an eye at wo (rgb) by some lobes, and the density with which a walk from wo goes on to wi (a), by whichever; without deltas.
vec4 scattering_by(Arrival a, vec3 wo, vec3 wi, uint lobes) {
    Arrival seen = arrival_from(a, wo);
    ScatteringFrame frame = scattering_frame(seen, arrival_normal(seen));
    if (!sides_agree(frame.z, frame.outward, wi)) {
        return vec4(0.0);
    }
    return bsdf_eval_part(seen.bsdf, frame.wo, world_to_frame(frame, wi), LOBE_ALL, lobes);
}

// By all.
vec4 scattering(Arrival a, vec3 wo, vec3 wi) { return scattering_by(a, wo, wi, LOBE_ALL); }

// Of a surface the lobes of a class, LOBE_DIFFUSE or LOBE_GLOSSY, that scatter between two directions away from it: reflections, or those that let light through.
uint lobes_between(Arrival a, vec3 u, vec3 v, uint lobes) {
    float sides = dot(u, a.surface.geometric_normal) * dot(v, a.surface.geometric_normal);
    return lobes & (sides > 0.0 ? LOBE_REFLECTION : LOBE_TRANSMISSION);
}

// Probability with which bsdf_sample chooses a delta lobe.
float delta_choice(Bsdf b, vec3 wo, bool reflected) {
    bool below = wo.z < 0.0;
    bool inside = HAS_TRANSMISSION && below && b.transmission > 0.0 && (b.flags & BSDF_THIN) == 0u;
    float cos_o = abs(wo.z);
    float eta = inside ? 1.0 / b.eta : b.eta;
    float p_cosine = cosine_probability(b, cosine_lobes(b, cos_o, inside, LOBE_ALL), cos_o, eta, LOBE_ALL);
    vec3 r;
    vec3 t;
    microfacet_split(b, cos_o, eta, LOBE_ALL, r, t);
    float p_reflection = reflection_probability(r, t);
    return (1.0 - p_cosine) * (reflected ? p_reflection : 1.0 - p_reflection);
}

// Density of the way back over that of the way there, of a walk that a delta lobe has scattered: by probabilities of the lobe and, where it refracts, by
// solid angles. Zero where the normal is bent for one of both directions, so that no walk comes back the same way.
float delta_ratio(Arrival a, ScatteringFrame frame, BsdfSample scattered, vec3 wi) {
    Arrival back = arrival_from(a, wi);
    ScatteringFrame there = scattering_frame(back, arrival_normal(back));
    if ((HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) && any(notEqual(abs(there.z), abs(frame.z)))) {
        return 0.0;
    }
    bool reflected = (scattered.flags & LOBE_REFLECTION) != 0u;
    float ratio = delta_choice(a.bsdf, there.wo, reflected) / scattered.choice;
    if (HAS_TRANSMISSION && !reflected && (a.bsdf.flags & BSDF_THIN) == 0u) {
        float eta = frame.wo.z > 0.0 ? a.bsdf.eta : 1.0 / a.bsdf.eta;
        ratio *= abs(frame.wo.z) / (abs(scattered.wi.z) * eta * eta);
    }
    return ratio;
}

#endif
