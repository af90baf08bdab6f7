// What kernels bind of a scene that the driver's acceleration structure indexes: set 1 in place of IndexSet.
#ifndef CLERESTORY_ACCEL_DRIVER_BINDINGS_GLSL
#define CLERESTORY_ACCEL_DRIVER_BINDINGS_GLSL

#include "accel/index_rays.glsl"

// descriptor set 1: DriverSet

// The header, and triangles in the order of the structure's boxes, three texels each: vertex 0, 1, 2, the triangle's index, two that are unused.
// Header: lower corner of all triangles, the furthest reach of rays that the boxes are grown for | upper corner, how many triangles there are |
// origin of the structure's coordinates, one that is unused. Twin of clerestory::accel::driver.
layout(set = 1, binding = 0) uniform utextureBuffer driver_triangles;
// A grown box for each triangle.
layout(set = 1, binding = 1) uniform accelerationStructureEXT driver_boxes;

const uint DRIVER_HEADER_TEXELS = 3u;
const uint DRIVER_TRIANGLE_TEXELS = 3u;

uvec4 driver_texel(uint index) { return texelFetch(driver_triangles, int(index)); }

#endif
