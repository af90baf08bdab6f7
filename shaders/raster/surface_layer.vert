#version 460
// The scene's triangles in several views, an instance and a layer for each.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_ARB_shader_viewport_layer_array : require

#include "raster/weighted_vertex.glsl"

void main() {
    raster_weighted_vertex(uint(gl_InstanceIndex));
    gl_Layer = gl_InstanceIndex;
}
