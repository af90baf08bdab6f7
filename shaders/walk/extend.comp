#version 460
// The extend stage of a wave, the closest hit of every walk's ray: walk/extend.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "walk/extend.glsl"
