// Which points seen lie on the same surface, as far as plane and normal tell: what filters and upsampling average over.
#ifndef CLERESTORY_RASTER_SAME_SURFACE_GLSL
#define CLERESTORY_RASTER_SAME_SURFACE_GLSL

// Whether another point lies in the tangent plane of a point, up to a distance.
bool lies_in_plane(vec3 position, vec3 normal, vec3 other, float plane_max) { return abs(dot(normal, other - position)) <= plane_max; }

// Whether another normal is this one, up to a cosine.
bool is_same_normal(vec3 normal, vec3 other, float normal_min) { return dot(normal, other) > normal_min; }

#endif
