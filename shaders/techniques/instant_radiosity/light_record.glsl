// The size of a virtual light's record (virtual_light.glsl).
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_LIGHT_RECORD_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_LIGHT_RECORD_GLSL

const uint VIRTUAL_LIGHT_QUARTERS = 4u;
// The one whose first three words are the power that arrives.
const uint LIGHT_POWER_QUARTER = 2u;

#endif
