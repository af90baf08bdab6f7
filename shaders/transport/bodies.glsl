// Which medium a way was in, and which one is beyond the surface that ends it; see walk/media.glsl.
#ifndef CLERESTORY_TRANSPORT_BODIES_GLSL
#define CLERESTORY_TRANSPORT_BODIES_GLSL

#include "scene/bindings.glsl"

// Stands for the material of a body where there is none around.
const uint OUTSIDE = 0xFFFFFFFFu;
const uint NO_MEDIUM = 0xFFFFFFFFu;

struct Crossing {
    uint interior;  // body that the way was in, or OUTSIDE
    uint beyond;    // body on the other side
    bool boundary;  // the surface is there for media alone
};

// The way in `direction` to a triangle, believed to be inside `interior`.
Crossing cross_surface(uint triangle_index, vec3 direction, uint interior) {
    SceneTriangle triangle = load_triangle(triangle_index);
    count_quarters(3u);
    uint flags = material_quarter(triangle.material, 1u).w;
    float transmission = uintBitsToFloat(material_quarter(triangle.material, 3u).w);
    float thickness = uintBitsToFloat(material_quarter(triangle.material, 6u).w);
    bool boundary = (flags & MATERIAL_BOUNDARY) != 0u;
    if (!boundary && !(transmission > 0.0 && thickness > 0.0)) {
        return Crossing(interior, interior, false);
    }
    bool entering = dot(cross(triangle.b - triangle.a, triangle.c - triangle.a), direction) < 0.0;
    uint around = triangle.around - 1u;
    return entering ? Crossing(around, triangle.material, boundary) : Crossing(triangle.material, around, boundary);
}

// Whether light from outside reaches the inside of a body unbent: what is inside a solid that refracts has none but that of lamps inside.
bool is_open(uint interior) { return interior == OUTSIDE || (material_quarter(interior, 1u).w & MATERIAL_BOUNDARY) != 0u; }

// Index of the medium inside a body, or NO_MEDIUM; `surrounding` is the one outside all.
uint medium_inside(uint interior, uint surrounding) {
    if (interior == OUTSIDE) {
        return surrounding;
    }
    count_quarters(1u);
    return material_quarter(interior, 9u).z - 1u;
}

#endif
