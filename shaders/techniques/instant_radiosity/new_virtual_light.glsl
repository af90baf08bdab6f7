// A virtual light where light has arrived.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_NEW_VIRTUAL_LIGHT_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_NEW_VIRTUAL_LIGHT_GLSL

#include "techniques/instant_radiosity/virtual_light.glsl"
#include "transport/arrival.glsl"

VirtualLight new_virtual_light(Arrival a, uint triangle, vec2 barycentrics, vec3 power, vec3 direction, uint bounce) {
    VirtualLight light;
    light.position = a.surface.point.position;
    light.triangle = triangle;
    light.normal = a.facing;
    light.offset = dot(abs(a.facing), a.surface.point.error);
    light.power = power;
    light.direction = direction;
    light.surface = LAMBERT ? cosine_lobes(a.bsdf, 1.0, false, LOBE_DIFFUSE).diffuse : vec3(barycentrics, 0.0);
    light.bounce = bounce;
    return light;
}

#endif
