// How a G-buffer keeps shading normals.
#ifndef CLERESTORY_RASTER_SEEN_NORMALS_GLSL
#define CLERESTORY_RASTER_SEEN_NORMALS_GLSL

#include "maps/packed_direction.glsl"

const uint SHADING_NORMAL_BITS = 16u;  // of each coordinate, as Output::Normals has them

// The shading normal of a pixel of Output::Normals.
vec3 shading_normal(uvec2 words) { return unpack_octahedral(words.y, SHADING_NORMAL_BITS); }

#endif
