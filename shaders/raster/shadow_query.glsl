// A place on a surface that a shadow map is asked about.
#ifndef CLERESTORY_RASTER_SHADOW_QUERY_GLSL
#define CLERESTORY_RASTER_SHADOW_QUERY_GLSL

struct ShadowQuery {
    vec3 position;
    float slack;   // by how much it may be off its plane, m
    vec3 normal;   // geometric, unit, of either side
};

#endif
