#version 460
// A rectangle as it is.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster_push.glsl"

layout(location = 0) flat out uint written;

void main() {
    gl_Position = raster_corner();
    written = value;
}
