#version 460
// The view's number is added to the value.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_multiview : require

#include "raster_push.glsl"

layout(location = 0) flat out uint written;

void main() {
    gl_Position = raster_corner();
    written = value + gl_ViewIndex;
}
