#version 460
// Each instance goes to the layer of its number, which is added to the value.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_ARB_shader_viewport_layer_array : require

#include "raster_push.glsl"

layout(location = 0) flat out uint written;

void main() {
    gl_Position = raster_corner();
    gl_Layer = gl_InstanceIndex;
    written = value + gl_InstanceIndex;
}
