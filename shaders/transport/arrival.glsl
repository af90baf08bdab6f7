// Where a path has arrived, of light or of the eye: the surface there, how it scatters, on which side and in which body the way was, and
// the frame that the path is scattered in. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_ARRIVAL_GLSL
#define CLERESTORY_TRANSPORT_ARRIVAL_GLSL

#include "scene/bindings.glsl"
#include "transport/bodies.glsl"
#include "transport/surface.glsl"

struct Arrival {
    Surface surface;
    SceneMaterial material;
    Bsdf bsdf;
    vec3 wo;         // back along the way
    vec3 facing;     // geometric normal, to the side of the way
    float distance;  // that the way was long
    bool front;      // of the triangle
    bool solid;      // the surface is that of a body with an inside
};

// z points out of a solid body, and to the side of the way elsewhere.
struct ScatteringFrame {
    vec3 x;
    vec3 y;
    vec3 z;
    vec3 outward;  // geometric normal, to the side of z
    vec3 wo;
};

Arrival arrival_at(Hit hit, vec3 direction, vec3 scene_lower, vec3 scene_upper) {
    Arrival a;
    a.surface = surface_at(hit, scene_lower, scene_upper);
    count_quarters(surface_material_quarters());
    a.material = load_material(a.surface.material);
    a.bsdf = surface_bsdf(a.material, a.surface);
    a.wo = -direction;
    a.front = dot(a.wo, a.surface.geometric_normal) > 0.0;
    a.facing = a.front ? a.surface.geometric_normal : -a.surface.geometric_normal;
    a.distance = hit.t;
    a.solid = HAS_TRANSMISSION && a.material.transmission > 0.0 && a.material.thickness > 0.0;
    return a;
}

bool arrival_is_unlit(Arrival a) { return HAS_UNLIT && (a.material.flags & MATERIAL_UNLIT) != 0u; }

// Photons are stored, and looked for, where a diffuse base is seen from outside the body.
bool arrival_has_diffuse_base(Arrival a) { return bsdf_has_diffuse_base(a.bsdf, a.solid && !a.front); }

// Virtual lights are placed, and gathered from, where anything is scattered into more than one direction.
bool arrival_has_rough_lobes(Arrival a) {
    bool microfacets = HAS_METAL || HAS_SPECULAR_LAYER || HAS_TRANSMISSION;
    return arrival_has_diffuse_base(a) || (microfacets && !bsdf_is_delta(a.bsdf));
}

// Material of the body that the way was in, or OUTSIDE; `known` is what the path knew: one that begins inside a solid learns it here.
uint arrival_interior(Arrival a, uint known) { return known == OUTSIDE && a.solid && !a.front ? a.surface.material : known; }

// What is left of light after a way inside a body.
vec3 absorbed(vec3 light, uint interior, float way) {
    if (HAS_ABSORPTION && interior != OUTSIDE) {
        count_quarters(1u);
        light *= exp(-load_material(interior).absorption * way);
    }
    return light;
}

// The shading normal, to the side of the way.
vec3 arrival_normal(Arrival a) {
    if (HAS_SHADING_NORMALS || HAS_NORMAL_MAPS) {
        return adapt_shading_normal(surface_mapped_normal(a.material, a.surface), a.facing, a.wo);
    }
    return a.facing;
}

ScatteringFrame scattering_frame(Arrival a, vec3 normal) {
    ScatteringFrame f;
    f.outward = a.solid ? a.surface.geometric_normal : a.facing;
    f.z = dot(f.outward, a.facing) < 0.0 ? -normal : normal;
    orthonormal_basis(f.z, f.x, f.y);
    f.wo = vec3(dot(a.wo, f.x), dot(a.wo, f.y), dot(a.wo, f.z));
    return f;
}

vec3 world_to_frame(ScatteringFrame f, vec3 v) { return vec3(dot(v, f.x), dot(v, f.y), dot(v, f.z)); }
vec3 frame_to_world(ScatteringFrame f, vec3 local) { return local.x * f.x + local.y * f.y + local.z * f.z; }

// Least cosine by which the offset of a ray's origin counts as a way through a medium.
const float LEAD_COS_MIN = 1.0 / 16.0;

// Length of the way along `direction` that the offset of a ray's origin leaves out.
float way_left_out(Surface s, vec3 origin, vec3 direction) {
    return distance(origin, s.point.position) / max(abs(dot(direction, s.geometric_normal)), LEAD_COS_MIN);
}

// Where a ray that leaves along wi begins; light loses what the body absorbs of the way that this start leaves out.
vec3 departure(Arrival a, vec3 wi, inout vec3 light) {
    SurfacePoint point = a.surface.point;
    vec3 origin = offset_ray_origin(point.position, point.error, a.surface.geometric_normal, wi);
    if (HAS_ABSORPTION && a.solid && dot(wi, a.surface.geometric_normal) < 0.0) {
        light *= exp(a.material.absorption * (distance(origin, point.position) / dot(wi, a.surface.geometric_normal)));
    }
    return origin;
}

#endif
