// A photon where it has collided with a medium: the record of a volume map, and the kernels of its estimates; or its way there, or two of its flights.
//
// The flux is that which the collision scatters, so that a query has no albedo to multiply by: sigma_s over the density of the collision is in it for each
// band. PM-VOL-7, PM-VOL-5: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, 3.4.2.4 and 7.1; after W. Jarosz, M. Zwicker and H. W. Jensen, "The
// Beam Radiance Estimate for Volumetric Photon Mapping", 2008. Twin of clerestory::techniques::photon_mapping::volume::event.
// Guarantees: kernels integrate to one, over a plane and over space.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EVENT_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_EVENT_GLSL

#include "accel/ray.glsl"
#include "techniques/photon_mapping/kernel.glsl"
#include "techniques/photon_mapping/photon_history.glsl"
#include "transport/photon_share.glsl"

const uint EVENT_QUARTERS = 2u;
// Of all records of a map that has another kind beside beams.
const uint WIDE_QUARTERS = 3u;
// The last word of such a record of a collision; 0 in others.
const uint POINT_RECORD = 1u;
// In the word of the medium: last record of a leaf.
const uint EVENT_LEAF_END = 0x80000000u;
const uint EVENT_MEDIUM_MASK = 0x00FFFFFFu;
// There, of beams: scatterings before.
const uint BEAM_BOUNCE_SHIFT = 24u;

// Kernels in the unit ball, in its middle: 3 / (4 pi), 3 / pi, 15 / (8 pi).
const float BALL_UNIFORM = 0.23873241463784300365;
const float BALL_CONE = 0.95492965855137201461;
const float BALL_EPANECHNIKOV = 0.59683103659460750913;

// By how much boxes are larger than kernels, so that no rounding of distances from a ray reaches beyond: of the radius, and of the place.
const float EVENT_SLACK = 1.0 / 65536.0;
const float EVENT_ROUNDING = 1.0 / 2097152.0;

struct PhotonEvent {
    vec3 position;
    vec3 direction;  // in which the photon came
    vec3 flux;       // that is scattered, as stored
    float radius;    // of its kernel, m
    uint medium;     // its index
    uint bounce;     // scatterings before this one, at most PHOTON_BOUNCE_MAX
};

void pack_event(PhotonEvent e, out uvec4 q0, out uvec4 q1) {
    uint way = pack_octahedral(e.direction, PHOTON_DIRECTION_BITS) | min(e.bounce, PHOTON_BOUNCE_MAX) << PHOTON_BOUNCE_SHIFT;
    q0 = uvec4(floatBitsToUint(e.position), e.medium & EVENT_MEDIUM_MASK);
    q1 = uvec4(pack_rgb9e5(e.flux), floatBitsToUint(e.radius), way, 0u);
}

PhotonEvent unpack_event(uvec4 q0, uvec4 q1) {
    PhotonEvent e;
    e.position = uintBitsToFloat(q0.xyz);
    e.direction = unpack_octahedral(q1.z, PHOTON_DIRECTION_BITS);
    e.bounce = q1.z >> PHOTON_BOUNCE_SHIFT;
    e.flux = unpack_rgb9e5(q1.x);
    e.radius = uintBitsToFloat(q1.y);
    e.medium = q0.w & EVENT_MEDIUM_MASK;
    return e;
}

bool event_ends_leaf(uvec4 q0) { return (q0.w & EVENT_LEAF_END) != 0u; }

// A piece of a photon's way through a homogeneous medium, in as many quarters.
struct PhotonBeam {
    vec3 start;
    vec3 end;
    vec3 flux;    // at its start, as stored
    uint medium;
    uint bounce;  // scatterings before
};

void pack_beam(PhotonBeam b, out uvec4 q0, out uvec4 q1) {
    q0 = uvec4(floatBitsToUint(b.start), b.medium & EVENT_MEDIUM_MASK | min(b.bounce, PHOTON_BOUNCE_MAX) << BEAM_BOUNCE_SHIFT);
    q1 = uvec4(floatBitsToUint(b.end), pack_rgb9e5(b.flux));
}

PhotonBeam unpack_beam(uvec4 q0, uvec4 q1) {
    uint bounce = q0.w >> BEAM_BOUNCE_SHIFT & PHOTON_BOUNCE_MAX;
    return PhotonBeam(uintBitsToFloat(q0.xyz), uintBitsToFloat(q1.xyz), unpack_rgb9e5(q1.w), q0.w & EVENT_MEDIUM_MASK, bounce);
}

// Two flights of a photon through a homogeneous medium, as far as it has come on each: it may have been scattered anywhere on the first one, into the second. The first two
// quarters are those of a beam along the first flight; the third one has the second flight, which is zero in a beam's record. Both have there what tells their light from eye paths'.
struct PhotonPlane {
    vec3 start;
    vec3 first;
    vec3 second;
    vec3 flux;    // at its start, as stored
    uint medium;
    uint bounce;  // scatterings before, with that between the flights
    float light;  // as distance2_in_plane has it, m2 or m; 0 where no eye path has a share
};

void pack_plane(PhotonPlane p, out uvec4 q0, out uvec4 q1, out uvec4 q2) {
    pack_beam(PhotonBeam(p.start, p.start + p.first, p.flux, p.medium, p.bounce), q0, q1);
    q2 = uvec4(floatBitsToUint(p.second), floatBitsToUint(p.light));
}

// A beam beside planes has the squared distance of its light from the first scattering there, m2, or 0 where no eye path finds it.
uvec4 pack_beside_planes(float light2) { return uvec4(uvec3(0u), floatBitsToUint(light2)); }
float beside_planes_light2(uvec4 q2) { return uintBitsToFloat(q2.w); }

PhotonPlane unpack_plane(uvec4 q0, uvec4 q1, uvec4 q2) {
    PhotonBeam b = unpack_beam(q0, q1);
    return PhotonPlane(b.start, b.end - b.start, uintBitsToFloat(q2.xyz), b.flux, b.medium, b.bounce, beside_planes_light2(q2));
}

bool is_plane(uvec4 q2) { return uintBitsToFloat(q2.xyz) != vec3(0.0); }

// A collision beside beams: its third quarter also has the flight that it ends. That of a beam says how long the flight before the beam's beginning was. Both have the squared distance at
// which the photon's light was from its first scattering, m2, or 0 where no eye path finds it.
uvec4 pack_flight(float flight, float light2, uint kind) { return uvec4(floatBitsToUint(flight), floatBitsToUint(light2), 0u, kind); }
float unpack_flight(uvec4 q2) { return uintBitsToFloat(q2.x); }
float unpack_light_distance2(uvec4 q2) { return uintBitsToFloat(q2.y); }
bool is_point(uvec4 q2) { return q2.w == POINT_RECORD; }

// Share that the estimate by collisions has of light that one by beams has, too, in media of this mean extinction: the balance heuristic. A photon collides within the disk of a
// ray with the density of its flight times the disk's area; its beam passes within a width of both sides, seen at an angle of this sine.
float point_share(float extinction, float flight, float collision_radius, float beam_radius, float sine) {
    float points = extinction * exp(-extinction * flight) * PI * collision_radius * collision_radius;
    float both = points + 2.0 * beam_radius * sine;
    return both > 0.0 ? points / both : 1.0;
}

// Extinction of the band through which light comes farthest, of those with any.
float least_extinction(vec3 sigma_t) {
    vec3 extinction = mix(sigma_t, vec3(FAR_AWAY), equal(sigma_t, vec3(0.0)));
    return min(extinction.x, min(extinction.y, extinction.z));
}

// Extinction with which the flights of planes end: of the band through which light comes farthest, of those that scatter.
float plane_extinction(vec3 sigma_s, vec3 sigma_t) { return least_extinction(mix(sigma_t, vec3(0.0), equal(sigma_s, vec3(0.0)))); }

// What takes from a beam's light along one that ends by chance, as a flight with that extinction does: what other bands have less of.
vec3 short_way_extinction(vec3 sigma_s, vec3 sigma_t) {
    float least = plane_extinction(sigma_s, sigma_t);
    return max(sigma_t, vec3(least)) - least;
}

// Where a ray meets the plane that two flights span.
struct PlaneMeeting {
    float t;         // along the ray
    vec2 along;      // shares of the flights
    float jacobian;  // volume of the box that the ray's direction spans with them, m2; 0 where the ray lies in the plane, and nothing else is known
};

PlaneMeeting meet_plane(vec3 origin, vec3 direction, vec3 start, vec3 first, vec3 second) {
    vec3 across = cross(first, second);
    float jacobian = dot(direction, across);
    if (!(abs(jacobian) > 0.0)) {
        return PlaneMeeting(0.0, vec2(-1.0), 0.0);
    }
    vec3 delta = origin - start;
    vec2 along = vec2(dot(delta, cross(second, direction)), dot(delta, cross(direction, first))) / jacobian;
    return PlaneMeeting(-dot(delta, across) / jacobian, along, abs(jacobian));
}

// Kernels of one dimension, of the squared distance in units of the radius: over a radius on both sides they integrate to one.
float line_profile(uint profile, float d2) {
    float k = profile == KERNEL_UNIFORM ? 0.5 : profile == KERNEL_CONE ? 1.0 - sqrt(d2) : 0.75 * (1.0 - d2);
    return d2 < 1.0 ? k : 0.0;
}

// Where a ray and a beam from `start` along the unit direction `way` come closest.
struct BeamMeeting {
    float t;        // along the ray
    float along;    // along the beam
    float squared;  // distance
    float sine;     // of the angle between them; 0 where they are parallel, and nothing else is known
};

BeamMeeting meet_beam(vec3 origin, vec3 direction, vec3 start, vec3 way) {
    vec3 across = cross(direction, way);
    float sine2 = dot(across, across);
    if (!(sine2 > 0.0)) {
        return BeamMeeting(0.0, 0.0, 0.0, 0.0);
    }
    vec3 delta = start - origin;
    float off = dot(delta, across);
    return BeamMeeting(dot(cross(delta, way), across) / sine2, dot(cross(delta, direction), across) / sine2, off * off / sine2, sqrt(sine2));
}

// Of the squared distance in the unit ball, 1/volume of the ball of radius 1.
float ball_profile(uint profile, float d2) {
    float k = profile == KERNEL_UNIFORM ? BALL_UNIFORM
        : profile == KERNEL_CONE ? BALL_CONE * (1.0 - sqrt(d2)) : BALL_EPANECHNIKOV * (1.0 - d2);
    return d2 < 1.0 ? k : 0.0;
}

#endif
