// Shares of light in media that photons find as well as eye paths that go on. Source, meaning and proof: transport/photon_share.rs, whose twin this is.
#ifndef CLERESTORY_TRANSPORT_PHOTON_SHARE_GLSL
#define CLERESTORY_TRANSPORT_PHOTON_SHARE_GLSL

#include "pi.glsl"

float mean_extinction(vec3 sigma_t) { return (sigma_t.x + sigma_t.y + sigma_t.z) / 3.0; }

// What stands for the area of a kernel in the density with which photons are seen, m2: of beams, that pass a ray within a radius at an angle of this sine, and of planes, of which two flights and
// the ray, of unit length, span a box of this volume.
float across_of_beams(float sine, float extinction, float radius) { return 2.0 * radius * sine / extinction; }
float across_of_planes(float jacobian, float extinction) { return jacobian / (extinction * extinction); }

// Squared distance of a light at which eye paths and so many photons of a pass, that are seen across an area, each have half of its light. `phase`: density of the phase function, 1/sr.
float even_distance2_across(float across, float phase, float photons) { return photons * across / (16.0 * PI * PI * phase); }

// The same of photons that are seen as collisions and, with `has_beams`, as beams. `sine`: of the angle between both directions at the eye path's first scattering; `extinction`: mean over
// bands, 1/m; `collision_radius`, `beam_radius`: of kernels, m.
float even_distance2(float phase, float sine, float extinction, float collision_radius, float beam_radius, float photons, bool has_beams) {
    float across = PI * collision_radius * collision_radius;
    if (has_beams) {
        across += across_of_beams(sine, extinction, beam_radius);
    }
    return even_distance2_across(across, phase, photons);
}

// Share of eye paths in light of that squared distance, and that of photons, which is what they leave. Neither divides by what is not positive, and an infinite argument gives no NaN.
float eye_share(float light2, float even_distance2) { return light2 > 0.0 ? 1.0 / (1.0 + even_distance2 / light2) : 0.0; }
float photon_share(float light2, float even_distance2) { return light2 > 0.0 ? 1.0 / (1.0 + light2 / even_distance2) : 1.0; }

// Stands for the squared distance of light without a place: from infinity, or that a medium emits; by the box of the scene, m2.
float placeless_distance2(vec3 lower, vec3 upper) {
    vec3 across = upper - lower;
    return dot(across, across) / 16.0;
}

// Squared distance of the light, as a photon that has been scattered carries it: what it `carried` before, 0 at first but for light without a place. A mirror that scatters first leaves 0, since
// eye paths do not find such light.
float carried_distance2(float carried, uint bounce, float way, bool rough) {
    return bounce > 0u ? carried : !rough ? 0.0 : carried > 0.0 ? carried : way * way;
}

// Squared distance of light as it would be of one that a medium scatters first evenly, and not with this density, 1/sr.
float evened_distance2(float light2, float phase) { return light2 / (4.0 * PI * phase); }

// That of a plane's light, by what its record tells: the distance itself; or, where the scattering between both flights is the first one, of this density, minus how far the light is from the
// first flight's beginning, that is `along` before the scattering.
float distance2_in_plane(float told, float along, float phase) {
    float way = along - told;
    return told < 0.0 ? evened_distance2(way * way, phase) : told;
}

#endif
