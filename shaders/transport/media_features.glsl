// Which kinds of media a scene has, as specialization constants of the kernels that go through them. Their ids are none of those of
// transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_MEDIA_FEATURES_GLSL
#define CLERESTORY_TRANSPORT_MEDIA_FEATURES_GLSL

#include "scene/records.glsl"

layout(constant_id = 20) const bool HAS_GRIDS = true;  // media with a density grid
layout(constant_id = 21) const bool HAS_HOMOGENEOUS = true;

// Quarters of a medium that are read.
uint medium_quarters() { return HAS_GRIDS ? MEDIUM_QUARTERS : HOMOGENEOUS_MEDIUM_QUARTERS; }

#endif
