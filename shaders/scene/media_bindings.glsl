// Where kernels have the media of the scene: set 3, filled by clerestory::transport::GpuScene. Kernels whose set 3 holds more besides declare the same buffers there, and
// CLERESTORY_MEDIA_BOUND before they include scene/media.glsl.
#ifndef CLERESTORY_SCENE_MEDIA_BINDINGS_GLSL
#define CLERESTORY_SCENE_MEDIA_BINDINGS_GLSL

#extension GL_EXT_samplerless_texture_functions : require

// descriptor set 3: MediaSet

layout(set = 3, binding = 0) uniform utextureBuffer media_records;
layout(set = 3, binding = 1) uniform textureBuffer media_densities;  // of all grids, x fastest
layout(set = 3, binding = 2) uniform textureBuffer media_majorants;  // greatest densities of blocks of cells

#endif
