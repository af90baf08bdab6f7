// What kernels bind of a scene that the driver's acceleration structure indexes: set 1 in place of IndexSet.
#ifndef CLERESTORY_ACCEL_DRIVER_BINDINGS_GLSL
#define CLERESTORY_ACCEL_DRIVER_BINDINGS_GLSL

#extension GL_EXT_ray_query : require

#include "accel/index_rays.glsl"

// descriptor set 1: DriverSet

// A grown box for each triangle. It stands where kernels of other indexes have their texels: its type keeps either from being bound for the other.
layout(set = 1, binding = 0) uniform accelerationStructureEXT driver_boxes;

// The header, and triangles in the order of the structure's boxes, three texels each: vertex 0, 1, 2, the triangle's index, two that are unused.
// Header: lower corner of all triangles, the furthest reach of rays that the boxes are grown for | upper corner, how many triangles there are |
// origin of the structure's coordinates, one that is unused. Twin of clerestory::accel::driver.
layout(set = 1, binding = 1) uniform utextureBuffer driver_triangles;

const uint DRIVER_HEADER_TEXELS = 3u;
const uint DRIVER_TRIANGLE_TEXELS = 3u;

uvec4 driver_texel(uint index) { return texelFetch(driver_triangles, int(index)); }

#endif
