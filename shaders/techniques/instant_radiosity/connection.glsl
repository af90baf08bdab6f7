// What a virtual light brings to a point: the scattering functions at both ends and the geometry term between them up to its bound. Where the point was
// seen from, and whether anything stands between, is the includer's.
//
// SVO-G0, BG-8, MET-V1: A. Keller, "Instant Radiosity", 1997; T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", 2006.
// Expects the constants of transport/features.glsl, and, declared before the inclusion, a block `push` with the scene's corners `scene_lower` and `scene_upper` and
// the value `edge_bound` of the bound, and the texel buffer `virtual_light_texels` of the lights' records.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_CONNECTION_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_CONNECTION_GLSL

#include "finite.glsl"
#include "techniques/instant_radiosity/split_place.glsl"
#include "techniques/instant_radiosity/virtual_light.glsl"
#include "transport/arrival.glsl"
#include "transport/edge_bound.glsl"

layout(constant_id = 35) const uint EDGE_BOUND = EDGE_UNBOUNDED;

// Loop iterations that a connection without its ray counts as.
const uint CONNECTION_ITERATIONS = 4u;

// A point that virtual lights light, as it is seen.
struct Receiver {
    Arrival arrival;
    ScatteringFrame frame;
    uint interior;    // body that the way there was in
    uint bounce;      // scatterings between the point and the eye
    vec3 throughput;  // from the point on
};

// Radiant intensity over power, with the cosine, that a virtual light sends along `out_direction`, 1/sr: from the radiance that an eye path would find
// there, whose shading normal faces that direction, so that virtual lights and eye paths have the same light of a surface.
vec3 light_scattering(VirtualLight light, vec3 out_direction) {
    if (LAMBERT) {
        return light.surface * (INV_PI * max(dot(light.normal, out_direction), 0.0));
    }
    Arrival a = arrival_at(Hit(0.0, light.surface.xy, light.triangle), -out_direction, push.scene_lower, push.scene_upper);
    ScatteringFrame frame = scattering_frame(a, arrival_normal(a));
    vec3 in_direction = -light.direction;
    float cos_in = abs(dot(in_direction, a.surface.geometric_normal));
    if (!sides_agree(frame.z, frame.outward, in_direction) || !(cos_in > 0.0)) {
        return vec3(0.0);
    }
    // Radiance over irradiance times the cosine out; the scattering function has the shading normal's cosine in, the irradiance the surface's own.
    float cos_out = abs(dot(out_direction, a.surface.geometric_normal));
    return bsdf_eval(a.bsdf, frame.wo, world_to_frame(frame, in_direction), LOBE_ALL) * (cos_out / cos_in);
}

// Radiance that the receiver scatters of a virtual light's, if nothing stands between, and the ray that tells.
vec3 connection(Receiver r, VirtualLight light, out Ray ray) {
    Surface s = r.arrival.surface;
    vec3 way = light.position - s.point.position;
    float squared = dot(way, way);
    vec3 wi = way * inversesqrt(squared);
    ray = Ray(vec3(0.0), 0.0, vec3(0.0), 1.0);
    // A light at the point itself is on its own surface, or its distance is lost to rounding.
    if (!(squared > 0.0) || !sides_agree(r.frame.z, r.frame.outward, wi)) {
        return vec3(0.0);
    }
    vec3 found = light_scattering(light, -wi);
    if (found == vec3(0.0)) {
        return vec3(0.0);
    }
    found *= bsdf_eval(r.arrival.bsdf, r.frame.wo, world_to_frame(r.frame, wi), LOBE_ALL) * light.power / squared;
    if (EDGE_BOUND != EDGE_UNBOUNDED) {
        float cos_here = abs(dot(wi, s.geometric_normal));
        float cos_there = abs(dot(wi, light.normal));
        found *= bounded_share(EDGE_BOUND, push.edge_bound, cos_here, cos_there, squared);
    }
    if (HAS_ABSORPTION) {
        uint passed = r.arrival.solid ? (dot(wi, r.frame.outward) < 0.0 ? s.material : OUTSIDE) : r.interior;
        found = absorbed(found, passed, sqrt(squared));
    }
    ray.origin = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, wi);
    vec3 end = light.position + light.normal * (dot(light.normal, wi) > 0.0 ? -light.offset : light.offset);
    ray.direction = end - ray.origin;
    return finite_or_black(found);
}

VirtualLight load_virtual_light(uint index) {
    int first = int(VIRTUAL_LIGHT_QUARTERS * index);
    return unpack_virtual_light(texelFetch(virtual_light_texels, first), texelFetch(virtual_light_texels, first + 1),
                                texelFetch(virtual_light_texels, first + 2), texelFetch(virtual_light_texels, first + 3));
}

#endif
