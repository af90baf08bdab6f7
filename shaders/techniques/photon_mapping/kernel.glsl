// Kernels of density estimation on surfaces: ellipsoids as large as a photon's footprint, and the record of a photon in the map.
//
// Source: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 3.4.2, 5.2.1 and 5.2.2. An ellipsoid with the axes A (longer) and B in the tangent
// plane and C across it, |C| = |B|, is kept as A ("along") and P ("across"), which is B turned by a right angle in the plane, P.A > 0.
// Guarantees: a kernel integrates to one over the tangent plane; the box is tight; no length is compared with a constant, only with the
// unit length.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_KERNEL_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_KERNEL_GLSL

#include "transport/differentials.glsl"
#include "maps/packed_direction.glsl"
#include "transport/packing.glsl"

const uint KERNEL_UNIFORM = 0u;
const uint KERNEL_CONE = 1u;
const uint KERNEL_EPANECHNIKOV = 2u;

const uint KERNEL_SKEWED = 0u;     // axes are the differentials themselves
const uint KERNEL_PRINCIPAL = 1u;  // the same ellipse by its principal axes, which no frame decides on
const uint KERNEL_ISOTROPIC = 2u;  // disk of the footprint's area
const uint KERNEL_FIXED = 3u;      // disk of the radius length_max

const uint PHOTON_QUARTERS = 3u;
const uint PHOTON_NORMAL_BITS = 15u;
const uint PHOTON_DIRECTION_BITS = 13u;
const uint PHOTON_LEAF_END = 0x80000000u;  // in the word of the normal: last photon of a leaf

struct KernelSettings {
    uint shape;
    float spread;       // times the footprint, step sqrt(4 pi / n) included
    float exponent;     // of the footprint's length in unit lengths: 1 is undampened
    float unit_length;  // m
    float length_min;   // of axes, in unit lengths
    float length_max;
    float flatness;     // least |z1 x z2| / longer^2, FLATNESS_MIN if that is more
    uint widens_flat;   // flatter footprints are widened to it, instead of being left without a kernel
};

// Least flatness of all: weights are divided by the product of axes, which keeps ten bits less than they have.
const float FLATNESS_MIN = 1.0 / 1024.0;

struct PhotonKernel {
    vec3 along;
    vec3 across;
};

// Of the squared distance in the unit disk, 1/area of the disk of radius 1.
float kernel_profile(uint profile, float d2) {
    float k = profile == KERNEL_UNIFORM ? 1.0 : profile == KERNEL_CONE ? 3.0 - 3.0 * sqrt(d2) : 2.0 - 2.0 * d2;
    return d2 < 1.0 ? k * INV_PI : 0.0;
}

PhotonKernel disk_kernel(float radius, vec3 n) {
    vec3 t;
    vec3 b;
    orthonormal_basis(n, t, b);
    return PhotonKernel(radius * t, radius * t);
}

// The principal axes of the ellipse cos(x) a + sin(x) b, the longer one first.
void principal_axes(inout vec3 a, inout vec3 b) {
    float aa = dot(a, a);
    float bb = dot(b, b);
    float ab = dot(a, b);
    float swing = length(vec2(aa - bb, 2.0 * ab));
    if (swing > 0.0) {
        vec3 longer = aa >= bb ? a : b;
        vec3 shorter = aa >= bb ? b : a;
        float c = sqrt(0.5 + 0.5 * abs(aa - bb) / swing);
        float s = ab / (swing * c);
        a = c * longer + s * shorter;
        b = c * shorter - s * longer;
    }
}

// The kernel of a photon with differentials in the tangent plane across the unit normal n; false: it has none.
bool photon_kernel(KernelSettings s, Differentials d, vec3 n, out PhotonKernel kernel) {
    kernel = disk_kernel(s.length_max * s.unit_length, n);
    if (s.shape == KERNEL_FIXED) {
        return true;
    }
    vec3 a = d.z1 / s.unit_length;
    vec3 b = d.z2 / s.unit_length;
    if (s.shape == KERNEL_PRINCIPAL) {
        principal_axes(a, b);
    }
    vec2 lengths = vec2(length(a), length(b));
    if (lengths.x < lengths.y) {
        vec3 longer = b;
        b = a;
        a = longer;
        lengths = lengths.yx;
    }
    float area = length(cross(a, b));
    float flatness = max(s.flatness, FLATNESS_MIN);
    if (!(area > 0.0 && area >= flatness * lengths.x * lengths.x)) {
        if (s.widens_flat == 0u) {
            return false;
        }
        if (lengths.x <= 0.0) {
            kernel = disk_kernel(s.length_min * s.unit_length, n);
            return true;
        }
        principal_axes(a, b);
        b = flatness * cross(n, a);
        lengths = length(a) * vec2(1.0, flatness);
        area = lengths.x * lengths.y;
    }
    if (s.shape == KERNEL_ISOTROPIC) {
        float radius = s.spread * pow(area, 0.5 * s.exponent);
        kernel = disk_kernel(clamp(radius, s.length_min, s.length_max) * s.unit_length, n);
        return true;
    }
    vec2 wanted = s.spread * pow(lengths.x, s.exponent - 1.0) * lengths;
    vec2 scale = clamp(wanted, s.length_min, s.length_max) / lengths * s.unit_length;
    a *= scale.x;
    b *= scale.y;
    vec3 across = cross(b, n);
    kernel = PhotonKernel(a, dot(across, a) < 0.0 ? -across : across);
    return true;
}

// |A x B|, the area of the ellipse over pi.
float kernel_area(PhotonKernel k) { return dot(k.along, k.across); }

// Half of the sides of the ellipsoid's box.
vec3 kernel_extent(PhotonKernel k) {
    return sqrt(k.along * k.along + max(dot(k.across, k.across) - k.across * k.across, 0.0));
}

// Kernel at `delta` from the photon, 1/area.
float kernel_weight(uint profile, PhotonKernel k, vec3 delta) {
    float inverse_area = 1.0 / kernel_area(k);
    float q = dot(k.across, delta) * inverse_area;
    vec3 rest = delta - q * k.along;
    return kernel_profile(profile, q * q + dot(rest, rest) / dot(k.across, k.across)) * inverse_area;
}

// A photon in the map, PHOTON_QUARTERS quarters. The flux is relative to the light's flux / n, and not yet divided by the kernel's area.
struct PhotonRecord {
    vec3 position;
    vec3 normal;     // to the side that the photon came from
    vec3 direction;  // in which it came
    vec3 flux;
    PhotonKernel kernel;
};

void pack_photon(PhotonRecord p, out uvec4 q0, out uvec4 q1, out uvec4 q2) {
    q0 = uvec4(floatBitsToUint(p.position), pack_octahedral(p.normal, PHOTON_NORMAL_BITS));
    q1 = uvec4(floatBitsToUint(p.kernel.across), pack_octahedral(p.direction, PHOTON_DIRECTION_BITS));
    q2 = uvec4(floatBitsToUint(p.kernel.along), pack_rgb9e5(p.flux));
}

bool photon_ends_leaf(uvec4 q0) { return (q0.w & PHOTON_LEAF_END) != 0u; }

vec3 photon_normal(uvec4 q0) { return unpack_octahedral(q0.w, PHOTON_NORMAL_BITS); }

vec3 photon_direction(uvec4 q1) { return unpack_octahedral(q1.w, PHOTON_DIRECTION_BITS); }

vec3 photon_flux(uvec4 q2) { return unpack_rgb9e5(q2.w); }

// What a unit of the photon's flux counts for at x on a surface of normal n, 1/area; 0 where the cosine between the normals is not above normal_cos_min.
float photon_weight(uint profile, uvec4 q0, uvec4 q1, uvec4 q2, vec3 x, vec3 n, float normal_cos_min) {
    PhotonKernel k = PhotonKernel(uintBitsToFloat(q2.xyz), uintBitsToFloat(q1.xyz));
    float weight = kernel_weight(profile, k, x - uintBitsToFloat(q0.xyz));
    return weight > 0.0 && dot(photon_normal(q0), n) > normal_cos_min ? weight : 0.0;
}

#endif
