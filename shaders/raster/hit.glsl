// Where the ray of a pixel's centre meets the plane of the triangle that covers it: the ray caster's own test, so that distances and
// weights are those of a ray cast through the same place.
#ifndef CLERESTORY_RASTER_HIT_GLSL
#define CLERESTORY_RASTER_HIT_GLSL

#include "accel/triangle.glsl"
#include "raster/bindings.glsl"

struct RasterHit {
    vec3 weights;    // of the corners
    float distance;  // from where the ray begins
};

vec2 raster_place(RasterView view, vec2 pixel) {
    precise vec2 place = vec2(view.scale_x, view.scale_y) * pixel + vec2(view.offset_x, view.offset_y);
    return place;
}

vec3 raster_across(RasterView view, vec2 place) {
    precise vec3 across = place.x * view.right + place.y * view.down;
    return across;
}

// The rasterizer rounds the places of vertices, so that it covers pixels whose rays just miss the triangle: there the nearest weights
// count.
RasterHit raster_hit(RasterView view, SceneTriangle t, vec2 pixel) {
    vec3 across = raster_across(view, raster_place(view, pixel));
    bool is_parallel = view.parallel != 0u;
    precise vec3 origin = is_parallel ? view.origin + across : view.origin;
    precise vec3 direction = is_parallel ? view.forward : view.forward + across;
    TriangleHit found;
    bool inside = intersect_triangle(ray_shear(origin, direction), t.a, t.b, t.c, 0.0, uintBitsToFloat(0x7F800000u), found);
    vec3 weights = vec3(1.0 - found.barycentrics.x - found.barycentrics.y, found.barycentrics);
    if (!inside) {
        // Comparisons are false for NaN, which triangles seen edge-on give.
        weights = mix(vec3(0.0), weights, greaterThan(weights, vec3(0.0)));
        float sum = weights.x + weights.y + weights.z;
        weights = sum > 0.0 && !isinf(sum) ? weights / sum : vec3(1.0, 0.0, 0.0);
        vec3 p = weights.x * (t.a - origin) + weights.y * (t.b - origin) + weights.z * (t.c - origin);
        found.t = dot(p, is_parallel ? view.forward : view.w.xyz);
    }
    return RasterHit(weights, found.t * length(direction));
}

// The same from weights that the rasterizer interpolated: exact as far as the projection is linear over the primitive.
RasterHit raster_interpolated(RasterView view, SceneTriangle t, vec2 weights) {
    vec3 w = vec3(1.0 - weights.x - weights.y, weights);
    return RasterHit(w, length(t.a - view.origin + (w.y * (t.b - t.a) + w.z * (t.c - t.a))));
}

// Rounding of the three terms of a direction, none above 1.
const float RASTER_DIRECTION_ROUNDING = 1.0 / 2097152.0;

// Whether the direction of a pixel lies in the octant of a view, its border and what rounding leaves open of it included: every pixel lies
// in one at least.
bool raster_is_in_octant(RasterView view, vec2 pixel) {
    vec3 direction = view.forward + raster_across(view, raster_place(view, pixel));
    return all(greaterThanEqual(view.signs * direction, vec3(-RASTER_DIRECTION_ROUNDING)));
}

#endif
