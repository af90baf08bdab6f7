// How a G-buffer keeps shading normals.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_NORMALS_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_NORMALS_GLSL

const uint SHADING_NORMAL_BITS = 16u;  // of each coordinate, as Output::Normals has them

#endif
