// What a pixel sees as a point that virtual lights light. Expects what connection.glsl does.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_RECEIVER_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_RECEIVER_GLSL

#include "techniques/instant_radiosity/connection.glsl"
#include "techniques/instant_radiosity/seen.glsl"

// False where the surface scatters into single directions alone.
bool receiver_of_pixel(SeenFrom from, uvec2 pixel, SplitPlace seen, out Receiver r) {
    vec3 origin;
    vec3 direction = seen_direction(from, pixel, origin);
    r.arrival = arrival_at(Hit(0.0, seen.weights, seen.triangle), direction, push.scene_lower, push.scene_upper);
    if (!arrival_has_rough_lobes(r.arrival)) {
        return false;
    }
    r.bounce = 0u;
    r.interior = arrival_interior(r.arrival, OUTSIDE);
    r.throughput = absorbed(vec3(1.0), r.interior, distance(origin, r.arrival.surface.point.position));
    r.frame = scattering_frame(r.arrival, arrival_normal(r.arrival));
    return true;
}

#endif
