// Which sampler slot (two dimensions each) every decision of a walk draws from.
#ifndef CLERESTORY_WALK_DIMENSIONS_GLSL
#define CLERESTORY_WALK_DIMENSIONS_GLSL

// Those before are for a walk's start. From here on each bounce has DIMENSIONS_PER_BOUNCE slots.
const uint DIMENSION_FIRST_BOUNCE = 2u;
const uint DIMENSIONS_PER_BOUNCE = 5u;
const uint DIMENSION_DIRECTION = 0u;    // direction within a lobe
const uint DIMENSION_LOBE = 1u;         // lobe; Russian roulette
const uint DIMENSION_LIGHT = 2u;        // which light
const uint DIMENSION_LIGHT_POINT = 3u;  // point of a triangle, or texel of the environment
const uint DIMENSION_LIGHT_WITHIN = 4u; // direction within the texel

// Ways through media have slots of their own, far behind those of all bounces.
const uint DIMENSION_FIRST_MEDIUM = 1u << 24;
const uint DIMENSIONS_PER_WAY = 2u;
const uint DIMENSION_AIRLIGHT = 1u;  // which light, and where on the way; the first is for the free flight

#endif
