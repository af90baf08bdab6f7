// What tells whether a point sees a virtual light.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_VISIBILITY_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_VISIBILITY_GLSL

const uint VISIBILITY_NONE = 0u;  // nothing: light goes through everything
const uint VISIBILITY_RAYS = 1u;  // a shadow ray
const uint VISIBILITY_MAPS = 2u;  // the light's shadow map

layout(constant_id = 143) const uint VISIBILITY = VISIBILITY_RAYS;

#endif
