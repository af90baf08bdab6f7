#version 460
// ambient.comp for the driver's acceleration structures.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_ray_query : require

#define CLERESTORY_INDEX_DRIVER
#include "techniques/ambient/ambient.glsl"
