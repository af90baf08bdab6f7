// Shading normals under which no more light is seen than arrives.
//
// Method: the shading normal is turned to the side of the geometric normal and, where it faces away from the viewer, bent towards him
// until it is just visible; scattered directions that lie on different sides of the two normals are rejected (Veach 1997, 5.3,
// describes the trouble). Guarantee: reflectances seen from any direction are those of the scattering function or less, since
// f |cos to the shading normal| is integrated over a part of its domain. Reciprocity is lost, as with every shading normal, and with it the
// same for beams: one that comes in flat to the surface, but not to the shading normal, scatters more energy than it brings.
#ifndef CLERESTORY_TRANSPORT_SHADING_NORMAL_GLSL
#define CLERESTORY_TRANSPORT_SHADING_NORMAL_GLSL

#include "scene/normal_map.glsl"

// Least cosine between the adapted normal and wo: far above rounding errors, far below what the eye sees of a bent normal.
const float VISIBLE_COS_MIN = 1e-3;

// The shading normal to use, on the side of wo; `ng` must already face wo. For the inside of a solid the caller turns the result
// back, since a scattering frame's z points out of the body.
vec3 adapt_shading_normal(vec3 ns, vec3 ng, vec3 wo) {
    ns = dot(ns, ng) < 0.0 ? -ns : ns;
    float c = dot(ns, wo);
    return c < VISIBLE_COS_MIN ? normalize(ns + (VISIBLE_COS_MIN - c) * wo) : ns;
}

// Whether a direction lies on the same side of both normals; what does not is rejected by sampling and evaluation alike.
bool sides_agree(vec3 ns, vec3 ng, vec3 wi) { return dot(ns, wi) * dot(ng, wi) > 0.0; }

#endif
