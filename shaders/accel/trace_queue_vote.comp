// As trace_queue.comp, for kd-trees: leaves wait until each lane of a subgroup has one, which the subgroup votes on, and are tested together.
//
// Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §4.3.2.3, after T. Aila and S. Laine,
// "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009 (speculative traversal).
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_vote : require

layout(local_size_x_id = 0) in;

#define KD_CACHES
#define KD_VOTES
#include "accel/trace_queue.glsl"
