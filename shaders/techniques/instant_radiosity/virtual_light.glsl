// The record of a virtual light: a surface point where power from the lights has arrived, which it scatters on. 64 bytes, four quarters:
//   place and triangle; geometric normal to the side that the power came from, and by how much rays must start off the surface;
//   power that arrives, W, as if its walk were the only one, and the way it came, by the octahedron map in two words;
//   where all surfaces scatter by Lambert's law (LAMBERT) the reflectance there, elsewhere the barycentric coordinates, by which the surface is looked up.
// The last word is the number of scatterings before.
//
// SVO-G0, BG-8, MET-V1: A. Keller, "Instant Radiosity", 1997. The power is that which arrives, as of photons; reflected power would be tied to one direction.
// Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_VIRTUAL_LIGHT_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_VIRTUAL_LIGHT_GLSL

#include "maps/octahedron.glsl"
#include "techniques/instant_radiosity/light_record.glsl"

// Where every surface scatters alike in all directions, on the side that light came from.
const bool LAMBERT = !HAS_SPECULAR_LAYER && !HAS_METAL && !HAS_TRANSMISSION && !HAS_SHADING_NORMALS && !HAS_NORMAL_MAPS;

struct VirtualLight {
    vec3 position;
    uint triangle;
    vec3 normal;     // geometric, to the side of the way that the power came
    float offset;    // along the normal, m
    vec3 power;      // W
    vec3 direction;  // of the power
    vec3 surface;    // LAMBERT: reflectance; else barycentric coordinates in xy
    uint bounce;     // scatterings before
};

void pack_virtual_light(VirtualLight light, out uvec4 quarters[VIRTUAL_LIGHT_QUARTERS]) {
    uvec2 way = floatBitsToUint(octahedron_encode(light.direction));
    uvec3 surface = floatBitsToUint(light.surface);
    quarters[0] = uvec4(floatBitsToUint(light.position), light.triangle);
    quarters[1] = floatBitsToUint(vec4(light.normal, light.offset));
    quarters[LIGHT_POWER_QUARTER] = uvec4(floatBitsToUint(light.power), way.x);
    // By Lambert's law the way does not matter beyond its side.
    quarters[3] = uvec4(surface.xy, LAMBERT ? surface.z : way.y, light.bounce);
}

VirtualLight unpack_virtual_light(uvec4 q0, uvec4 q1, uvec4 q2, uvec4 q3) {
    VirtualLight light;
    light.position = uintBitsToFloat(q0.xyz);
    light.triangle = q0.w;
    light.normal = uintBitsToFloat(q1.xyz);
    light.offset = uintBitsToFloat(q1.w);
    light.power = uintBitsToFloat(q2.xyz);
    light.direction = LAMBERT ? -light.normal : octahedron_decode(uintBitsToFloat(uvec2(q2.w, q3.z)));
    light.surface = uintBitsToFloat(q3.xyz);
    light.bounce = q3.w;
    return light;
}

#endif
