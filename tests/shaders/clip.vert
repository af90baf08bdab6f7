#version 460
// Only the right half of the rectangle is there, by a clip distance.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster_push.glsl"

layout(location = 0) flat out uint written;

void main() {
    gl_Position = raster_corner();
    gl_ClipDistance[0] = float(gl_VertexIndex & 1) - 0.5;
    written = value;
}
