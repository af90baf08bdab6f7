// What surfaces are rasterized with: views and objects (set 0), beside the scene (set 2).
//
// A view maps a point p to the clip space of its part of the target: each coordinate is dot(row.xyz, p - origin) + row.w. It is the
// central projection of a camera, of a cube's face or of an octant of the octahedron, or a parallel one; what the rasterizer divides by is
// the distance along the ray of a pixel whose direction has the coordinate w of 1. Twin of clerestory::raster::View, which states how
// depths are stored.
#ifndef CLERESTORY_RASTER_BINDINGS_GLSL
#define CLERESTORY_RASTER_BINDINGS_GLSL

#define CLERESTORY_FLAT_SCENE
#include "scene/bindings.glsl"

// Octants have planes between them; other views have none, and signs of 0.
struct RasterView {
    vec4 x;
    vec4 y;
    vec4 z;
    vec4 w;
    vec3 origin;
    uint parallel;  // rays are parallel to `forward`
    vec3 right;     // of the ray through the place (u, v) of the target: forward + u * right + v * down
    float scale_x;  // (u, v) of a pixel: scale * pixel + offset
    vec3 down;
    float scale_y;
    vec3 forward;
    float offset_x;
    vec3 signs;
    float offset_y;
};

// descriptor set 0: RasterSet

layout(set = 0, binding = 0, scalar) restrict readonly buffer RasterViews {
    RasterView raster_views[];
};
layout(set = 0, binding = 1) uniform utextureBuffer raster_objects;  // by triangle

#endif
