// What a virtual light brings to a point in scenes with media, each of them on a surface or at a collision: as in connection.glsl, with the phase function and
// without a cosine at a collision. What the media let through, and whether anything stands between, is the includer's.
//
// CL-VPL-MEDIA: A. Keller, "Instant Radiosity", 1997, in media; bounds as T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", 2006.
// Expects what connection.glsl does, and the media of scene/media.glsl.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_MEDIUM_CONNECTION_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_MEDIUM_CONNECTION_GLSL

#include "techniques/instant_radiosity/collision_light.glsl"
#include "techniques/instant_radiosity/connection.glsl"
#include "scene/media.glsl"
#include "transport/phase.glsl"
#include "walk/medium_ray_state.glsl"

// A point that virtual lights light: of a collision the position, the way there and the body are known alone, and the frame is none.
struct MediumReceiver {
    Receiver at;
    uint medium;  // of the collision, or NO_MEDIUM on a surface
};

// Density per sr with which a medium scatters between propagation directions.
float medium_scattering(uint medium, vec3 w, vec3 wi) {
    SceneMedium m = load_medium(medium);
    return phase_function(m.phase, m.phase_parameter, w, wi);
}

// Radiance that the receiver scatters of a virtual light's, if nothing stands between and no medium takes of it, and the way that tells.
vec3 medium_connection(MediumReceiver r, MediumLight l, out ShadowWay shadow) {
    Surface s = r.at.arrival.surface;
    bool on_surface = r.medium == NO_MEDIUM;
    bool of_surface = l.medium == NO_MEDIUM;
    vec3 way = l.light.position - s.point.position;
    float squared = dot(way, way);
    vec3 wi = way * inversesqrt(squared);
    shadow = ShadowWay(Ray(vec3(0.0), 0.0, vec3(0.0), 1.0), r.at.interior, 0.0);
    // A light at the point itself is its own collision or surface, or its distance is lost to rounding.
    if (!(squared > 0.0) || (on_surface && !sides_agree(r.at.frame.z, r.at.frame.outward, wi))) {
        return vec3(0.0);
    }
    vec3 found;
    if (of_surface) {
        found = light_scattering(l.light, -wi);
    } else {
        found = vec3(medium_scattering(l.medium, l.light.direction, -wi));
    }
    if (found == vec3(0.0)) {
        return vec3(0.0);
    }
    float cos_here = 1.0;
    if (on_surface) {
        found *= bsdf_eval(r.at.arrival.bsdf, r.at.frame.wo, world_to_frame(r.at.frame, wi), LOBE_ALL);
        cos_here = abs(dot(wi, s.geometric_normal));
    } else {
        found *= medium_scattering(r.medium, -r.at.arrival.wo, wi);
    }
    found *= l.light.power / squared;
    if (EDGE_BOUND != EDGE_UNBOUNDED) {
        float cos_there = of_surface ? abs(dot(wi, l.light.normal)) : 1.0;
        found *= bounded_share(EDGE_BOUND, push.edge_bound, cos_here, cos_there, squared);
    }
    shadow.ray.origin = s.point.position;
    if (on_surface) {
        shadow.ray.origin = offset_ray_origin(s.point.position, s.point.error, s.geometric_normal, wi);
        shadow.interior = r.at.arrival.solid ? (dot(wi, r.at.frame.outward) < 0.0 ? s.material : s.around) : r.at.interior;
    }
    vec3 end = l.light.position + l.light.normal * (dot(l.light.normal, wi) > 0.0 ? -l.light.offset : l.light.offset);
    shadow.ray.direction = end - shadow.ray.origin;
    if (on_surface) {
        shadow.start = -way_left_out(s, shadow.ray.origin, wi) / length(shadow.ray.direction);
    }
    return finite_or_black(found);
}

MediumLight load_medium_light(uint index) {
    int first = int(VIRTUAL_LIGHT_QUARTERS * index);
    return unpack_medium_light(texelFetch(virtual_light_texels, first), texelFetch(virtual_light_texels, first + 1),
                               texelFetch(virtual_light_texels, first + 2), texelFetch(virtual_light_texels, first + 3));
}

#endif
