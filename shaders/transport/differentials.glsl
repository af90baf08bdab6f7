// Photon differentials: how position and direction of a photon change with the two parameters of its emission, carried along its path so
// that the distance to its neighbours is known wherever it lands.
//
// Sources: Igehy, "Tracing Ray Differentials" (1999); Schjoth, Frisvad, Erleben and Sporring, "Photon Differentials" (2007); Interactive
// Manycore Photon Mapping (2011), 3.1.2 and 5.1. Conventions: vectors are derivatives, unscaled by the step sqrt(4 pi / n) that n photons
// are apart in either parameter; a direction of density p per solid angle, which counts every choice up to the class of paths, has
// derivatives of length 1/sqrt(4 pi p). Guarantee: scaling the scene scales z1 and z2 and nothing else.
#ifndef CLERESTORY_TRANSPORT_DIFFERENTIALS_GLSL
#define CLERESTORY_TRANSPORT_DIFFERENTIALS_GLSL

#include "transport/warp.glsl"

// Least |cos| of incidence in a transfer: beyond it the footprint stops growing.
const float DIFFERENTIAL_COS_MIN = 1e-3;
// Least |cos| of the refracted direction in its derivative, which is infinite at the critical angle.
const float DIFFERENTIAL_REFRACTED_COS_MIN = 1e-3;
// Least cosine, or density in its place, of a re-emission: the variance of the footprint's area is infinite without.
const float DIFFERENTIAL_REEMISSION_COS_MIN = 0.02;
// Bound of all components; of positions in unit lengths.
const float DIFFERENTIAL_MAX = 1e6;

struct Differentials {
    vec3 z1;  // dz/dp1, length
    vec3 z2;
    vec3 w1;  // dw/dp1
    vec3 w2;
};

// A point emits with density `pdf` per solid angle.
Differentials emission_differentials(vec3 direction, float pdf) {
    vec3 t;
    vec3 b;
    orthonormal_basis(direction, t, b);
    float g = inversesqrt(4.0 * PI * pdf);
    return Differentials(vec3(0.0), vec3(0.0), g * t, g * b);
}

// A footprint of side sqrt(|z1 x z2|) that is absorbed and emitted anew with density `pdf` over directions of total solid angle `support`:
// from a point behind, so far that the expected area stays.
Differentials reemission_differentials(float side, vec3 direction, float pdf, float support) {
    float least = 2.0 * DIFFERENTIAL_REEMISSION_COS_MIN / support;
    Differentials d = emission_differentials(direction, max(pdf, least));
    float offset = side * sqrt(4.0 * PI / support);
    d.z1 = offset * d.w1;
    d.z2 = offset * d.w2;
    return d;
}

// A light with area emits: `pdf` per solid angle over the solid angle `support`, `pdf_area` per area.
Differentials area_light_differentials(vec3 direction, float pdf, float pdf_area, float support) {
    return reemission_differentials(inversesqrt(4.0 * PI * pdf_area), direction, pdf, support);
}

// A parallel beam, or all of the light from afar, starts on a disk across it with density `pdf_area` per area.
Differentials parallel_beam_differentials(vec3 direction, float pdf_area) {
    Differentials d = emission_differentials(direction, pdf_area);
    return Differentials(d.w1, d.w2, vec3(0.0), vec3(0.0));
}

// Of the unit direction along `pinhole` = axis + p1 * step1 + p2 * step2 from a pinhole.
Differentials camera_differentials(vec3 pinhole, vec3 step1, vec3 step2) {
    float scale = inversesqrt(dot(pinhole, pinhole));
    vec3 w = scale * pinhole;
    return Differentials(vec3(0.0), vec3(0.0), scale * (step1 - dot(w, step1) * w), scale * (step2 - dot(w, step2) * w));
}

// sqrt(|z1 x z2|): squares of the footprint's size are not formed, as they may vanish.
float footprint_side(Differentials d) {
    vec3 most = max(abs(d.z1), abs(d.z2));
    float size = max(most.x, max(most.y, most.z));
    return size > 0.0 ? size * sqrt(length(cross(d.z1 / size, d.z2 / size))) : 0.0;
}

vec3 transferred_differential(vec3 z, vec3 w, vec3 n, float incidence) {
    z -= dot(z, n) / incidence * w;
    return z - dot(z, n) * n;
}

// After the distance t along w to a surface of geometric normal n (of either side); z1 and z2 lie in its tangent plane.
Differentials transfer_differentials(Differentials d, float t, vec3 w, vec3 n) {
    float c = dot(w, n);
    float incidence = c < 0.0 ? min(c, -DIFFERENTIAL_COS_MIN) : max(c, DIFFERENTIAL_COS_MIN);
    d.z1 = transferred_differential(d.z1 + t * d.w1, w, n, incidence);
    d.z2 = transferred_differential(d.z2 + t * d.w2, w, n, incidence);
    return d;
}

// Derivatives of the normalised interpolated normal n0 + u (n1 - n0) + v (n2 - n0) on a triangle with edges e1, e2 from its first vertex:
// those of a normal turned to the other side have the other sign. Zero where the interpolated normal vanishes.
void normal_derivatives(vec3 e1, vec3 e2, vec3 n0, vec3 n1, vec3 n2, vec2 uv, Differentials d, out vec3 dn1, out vec3 dn2) {
    vec3 du = n1 - n0;
    vec3 dv = n2 - n0;
    vec3 n = n0 + uv.x * du + uv.y * dv;
    vec3 most = max(abs(e1), abs(e2));
    float scale = 1.0 / max(most.x, max(most.y, most.z));
    e1 *= scale;
    e2 *= scale;
    vec3 area = cross(e1, e2);
    float n_squared = dot(n, n);
    float area_squared = dot(area, area);
    dn1 = vec3(0.0);
    dn2 = vec3(0.0);
    if (n_squared > 0.0 && area_squared > 0.0) {
        float common_factor = scale * inversesqrt(n_squared) / area_squared;
        // Gradients of u and v in the triangle's plane, and the part across n of what changes with them.
        vec3 grad_u = common_factor * cross(e2, area);
        vec3 grad_v = common_factor * cross(area, e1);
        du -= dot(du, n) / n_squared * n;
        dv -= dot(dv, n) / n_squared * n;
        dn1 = du * dot(grad_u, d.z1) + dv * dot(grad_v, d.z1);
        dn2 = du * dot(grad_u, d.z2) + dv * dot(grad_v, d.z2);
    }
}

vec3 reflected_differential(vec3 dw, vec3 w, vec3 n, vec3 dn) { return dw - 2.0 * (dot(w, n) * dn + (dot(dw, n) + dot(w, dn)) * n); }

// Mirror reflection of w about n, which changes by dn1, dn2.
Differentials reflect_differentials(Differentials d, vec3 w, vec3 n, vec3 dn1, vec3 dn2) {
    d.w1 = reflected_differential(d.w1, w, n, dn1);
    d.w2 = reflected_differential(d.w2, w, n, dn2);
    return d;
}

// Refraction of w at n, which faces the incoming side (dot(w, n) < 0); eta = index there / index beyond. Where all is reflected, as
// reflect_differentials.
Differentials refract_differentials(Differentials d, vec3 w, vec3 n, float eta, vec3 dn1, vec3 dn2) {
    float c = dot(w, n);
    float squared = 1.0 - eta * eta * (1.0 - c * c);
    if (squared <= 0.0) {
        return reflect_differentials(d, w, n, dn1, dn2);
    }
    float refracted = -sqrt(squared);
    float mu = eta * c - refracted;
    float slope = eta - eta * eta * c / min(refracted, -DIFFERENTIAL_REFRACTED_COS_MIN);
    d.w1 = eta * d.w1 - (mu * dn1 + slope * (dot(d.w1, n) + dot(w, dn1)) * n);
    d.w2 = eta * d.w2 - (mu * dn2 + slope * (dot(d.w2, n) + dot(w, dn2)) * n);
    return d;
}

// Diffuse reflection or transmission into `direction` with density `pdf` over the hemisphere.
Differentials diffuse_reemission(Differentials d, vec3 direction, float pdf) {
    return reemission_differentials(footprint_side(d), direction, pdf, 2.0 * PI);
}

// A rough lobe: as if it had the density `pdf` in all of its directions, so that narrow lobes keep the area of each photon, not the mean of
// areas most of which lie in their tails.
Differentials rough_reemission(Differentials d, vec3 direction, float pdf) {
    float density = max(pdf, DIFFERENTIAL_REEMISSION_COS_MIN * INV_PI);
    return reemission_differentials(footprint_side(d), direction, density, 1.0 / density);
}

// Accounts for the survival of a roulette, or for the probability of choosing a specular lobe among others; to be applied once the new direction's
// derivatives are known.
Differentials roulette_differentials(Differentials d, float survival) {
    float scale = inversesqrt(survival);
    return Differentials(scale * d.z1, scale * d.z2, scale * d.w1, scale * d.w2);
}

bool differentials_exceed(vec3 v, float bound) {
    return any(greaterThan(floatBitsToUint(v) & uvec3(0x7FFFFFFFu), uvec3(floatBitsToUint(bound))));
}

// Zeroes differentials that are not numbers or too large; whether they were fit.
bool guard_differentials(inout Differentials d, float unit_length) {
    float bound = DIFFERENTIAL_MAX * unit_length;
    bool fit = !(differentials_exceed(d.z1, bound) || differentials_exceed(d.z2, bound) ||
                 differentials_exceed(d.w1, DIFFERENTIAL_MAX) || differentials_exceed(d.w2, DIFFERENTIAL_MAX));
    if (!fit) {
        d = Differentials(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
    }
    return fit;
}

#endif
