// Which sampler slot (two dimensions each) every decision of a walk draws from.
#ifndef CLERESTORY_WALK_DIMENSIONS_GLSL
#define CLERESTORY_WALK_DIMENSIONS_GLSL

// A walk's start, where it is from a light; eye paths have their pixel and lens there.
const uint DIMENSION_START_POINT = 0u;      // light, and point of it
const uint DIMENSION_START_DIRECTION = 1u;  // side of the light, and direction

// From here on each bounce has DIMENSIONS_PER_BOUNCE slots.
const uint DIMENSION_FIRST_BOUNCE = 2u;
const uint DIMENSIONS_PER_BOUNCE = 3u;
const uint DIMENSION_DIRECTION = 0u;  // lobe, and direction within it
const uint DIMENSION_SIDE = 1u;       // side of a rough microfacet; label of the lobe, and Russian roulette
const uint DIMENSION_LIGHT = 2u;      // light, and point or direction of it

// Ways through media have slots of their own, far behind those of all bounces.
const uint DIMENSION_FIRST_MEDIUM = 1u << 24;
const uint DIMENSIONS_PER_WAY = 2u;
const uint DIMENSION_AIRLIGHT = 1u;  // which light, and where on it or, of a light without extent, on the way; the first is for the free flight
// Where on a way light of a point of an area light is sampled, a slot for each way: two dimensions choose that point already.
const uint DIMENSION_FIRST_PLACE = 1u << 25;

#endif
