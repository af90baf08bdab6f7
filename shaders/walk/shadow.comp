#version 460
// The shadow stage of a wave, what walks' shadow rays carry: walk/shadow.glsl.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "walk/shadow.glsl"
