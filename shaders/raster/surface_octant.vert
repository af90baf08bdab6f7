#version 460
// The scene's triangles in the eight octants of an octahedron, an instance for each, side by side in one picture: clip distances cut
// them where octants meet, and the homogeneous coordinate is the sum of absolute coordinates, so that everything is interpolated as in perspective.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "raster/weighted_vertex.glsl"

void main() {
    vec3 p = raster_weighted_vertex(uint(gl_InstanceIndex));
    precise vec3 inside = raster_views[raster_view].signs * p;
    gl_ClipDistance[0] = inside.x;
    gl_ClipDistance[1] = inside.y;
    gl_ClipDistance[2] = inside.z;
}
