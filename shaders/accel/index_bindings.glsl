// The buffer of a ray index, set 1, of those whose kernels are the engine's own.
#ifndef CLERESTORY_ACCEL_INDEX_BINDINGS_GLSL
#define CLERESTORY_ACCEL_INDEX_BINDINGS_GLSL

#include "accel/index_rays.glsl"

// descriptor set 1: IndexSet

// What the texels hold stands in bvh2.glsl, kd.glsl and wide_layout.glsl. A texel buffer, since software drivers fetch texels for all lanes at once, but load
// storage buffers lane by lane.
layout(set = 1, binding = 0) uniform utextureBuffer index_texels;

uvec4 index_texel(uint index) { return texelFetch(index_texels, int(index)); }

#endif
