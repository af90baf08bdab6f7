#version 460
// Radiance from the volume map along eye paths' ways through media, the queries of a subgroup together.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require

#define COMPACT_PACKET

layout(local_size_x = 64) in;

#include "techniques/photon_mapping/photon_beam.glsl"
