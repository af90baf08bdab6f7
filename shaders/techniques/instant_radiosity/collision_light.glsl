// The record of a virtual light at a collision with a medium, beside those on surfaces and as large (virtual_light.glsl), four quarters:
//   place, and COLLISION_LIGHT where those on surfaces have their triangle; zeros where they have a normal, and the medium's index;
//   power that is scattered there, W, as if its walk were the only one, and the way it came, by the octahedron map in two words, of which the second one is the third word
//   of the last quarter. The last word is the number of scatterings before.
//
// CL-VPL-MEDIA: A. Keller, "Instant Radiosity", 1997, in media. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_COLLISION_LIGHT_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_COLLISION_LIGHT_GLSL

#include "techniques/instant_radiosity/virtual_light.glsl"
#include "transport/bodies.glsl"

const uint COLLISION_LIGHT = 0xFFFFFFFFu;

// A virtual light in a scene with media.
struct MediumLight {
    VirtualLight light;  // at a collision without normal and offset, and its power is what is scattered
    uint medium;         // of the collision, or NO_MEDIUM on a surface
};

void pack_collision_light(vec3 position, vec3 power, vec3 direction, uint medium, uint bounce, out uvec4 quarters[VIRTUAL_LIGHT_QUARTERS]) {
    uvec2 way = floatBitsToUint(octahedron_encode(direction));
    quarters[0] = uvec4(floatBitsToUint(position), COLLISION_LIGHT);
    quarters[1] = uvec4(0u, 0u, 0u, medium);
    quarters[LIGHT_POWER_QUARTER] = uvec4(floatBitsToUint(power), way.x);
    quarters[3] = uvec4(0u, 0u, way.y, bounce);
}

MediumLight unpack_medium_light(uvec4 q0, uvec4 q1, uvec4 q2, uvec4 q3) {
    MediumLight l = MediumLight(unpack_virtual_light(q0, q1, q2, q3), NO_MEDIUM);
    if (l.light.triangle == COLLISION_LIGHT) {
        l.light.normal = vec3(0.0);
        l.light.offset = 0.0;
        l.light.direction = octahedron_decode(uintBitsToFloat(uvec2(q2.w, q3.z)));
        l.medium = q1.w;
    }
    return l;
}

#endif
