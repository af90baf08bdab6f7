#version 460
// Radiance from the volume map along eye paths' ways through media, a query per invocation.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_beam.glsl"
