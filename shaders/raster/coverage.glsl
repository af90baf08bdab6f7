// Most fragments that a triangle can make in a view. Twin of clerestory::raster::coverage.
#ifndef CLERESTORY_RASTER_COVERAGE_GLSL
#define CLERESTORY_RASTER_COVERAGE_GLSL

#include "raster/project.glsl"

// Triangles of a block.
const uint COVERAGE_BLOCK = 64u;

// Pixels of the rectangle about a triangle's corners in a view; all pixels where it passes through the plane that the view begins at.
float coverage_fragments(RasterView view, vec2 size, uint triangle) {
    float all_pixels = size.x * size.y;
    vec2 lower = vec2(FAR_AWAY);
    vec2 upper = vec2(-FAR_AWAY);
    uint behind = 0u;
    for (uint corner = 0u; corner < 3u; ++corner) {
        vec3 p;
        if (!raster_corner(view, triangle, corner, p)) {
            return 0.0;
        }
        vec4 clip = raster_project(view, p);
        vec2 place = clip.xy / clip.w;
        lower = min(lower, place);
        upper = max(upper, place);
        behind += clip.z > clip.w ? 1u : 0u;
    }
    if (behind > 0u) {
        return behind < 3u ? all_pixels : 0.0;
    }
    if (any(greaterThan(lower, vec2(1.0))) || any(lessThan(upper, vec2(-1.0)))) {
        return 0.0;
    }
    // A rectangle holds one pixel centre more than its sides are long, at most.
    vec2 sides = min(0.5 * (min(upper, vec2(1.0)) - max(lower, vec2(-1.0))) * size + 1.0, size);
    float bound = sides.x * sides.y;
    // Not what is NaN.
    return bound <= all_pixels ? bound : all_pixels;
}

#endif
