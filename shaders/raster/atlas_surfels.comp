#version 460
// Points of the surfaces to where the surfaces are now.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#define CLERESTORY_FLAT_SCENE
#include "invocation.glsl"
#include "maps/packed_direction.glsl"
#include "raster/splat_atlas.glsl"
#include "scene/bindings.glsl"

layout(push_constant, scalar) uniform Push {
    uint count;
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer SurfelPlaces { SurfelPlace surfel_places[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer OrientedSurfels { OrientedSurfel oriented_surfels[]; };

void main() {
    uint index = invocation_index();
    if (index >= push.count) {
        return;
    }
    SurfelPlace place = surfel_places[index];
    SceneTriangle t = load_triangle(place.triangle);
    vec3 normal = normalize_or_zero(cross(t.b - t.a, t.c - t.a));
    OrientedSurfel surfel;
    surfel.position = t.a + place.weights.x * (t.b - t.a) + place.weights.y * (t.c - t.a);
    // What has no area any more has some direction.
    surfel.normal = pack_octahedral(normal == vec3(0.0) ? vec3(0.0, 0.0, 1.0) : normal, PACKED_NORMAL_BITS);
    oriented_surfels[index] = surfel;
}
