#version 460
// Ambient occlusion: techniques/ambient/ambient.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "techniques/ambient/ambient.glsl"
