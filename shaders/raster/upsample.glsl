// Bilateral upsampling. Twin of raster/upsample.rs.
#ifndef CLERESTORY_RASTER_UPSAMPLE_GLSL
#define CLERESTORY_RASTER_UPSAMPLE_GLSL

// Least sum of the neighbours' weights, which is 1 where all four count.
const float UPSAMPLE_WEIGHT_MIN = 0.01;

#endif
