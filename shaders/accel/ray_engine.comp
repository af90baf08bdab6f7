#version 460
// The ray engine: one triangle beside all rays, one ray an invocation; what it meets nearest is kept. A dispatch for each triangle finds closest hits without an index. A yardstick:
// engine/src/accel/yardstick/ray_engine.rs.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "accel/ray.glsl"
#include "accel/triangle.glsl"
#include "invocation.glsl"

layout(push_constant, scalar) uniform Push {
    uint triangle;
    uint rays;
} push;

struct EngineTriangle {
    vec3 a;
    vec3 b;
    vec3 c;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer EngineRays { Ray engine_rays[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer EngineTriangles { EngineTriangle engine_triangles[]; };
layout(set = 0, binding = 2, scalar) restrict buffer EngineHits { Hit engine_hits[]; };

void main() {
    uint i = invocation_index();
    if (i >= push.rays) {
        return;
    }
    Ray ray = engine_rays[i];
    if (!is_traceable(ray)) {
        return;
    }
    Hit nearest = engine_hits[i];
    EngineTriangle t = engine_triangles[push.triangle];
    TriangleHit found;
    RayShear shear = ray_shear(ray.origin, ray.direction);
    // Of equally near ones the first.
    if (intersect_triangle(shear, t.a, t.b, t.c, ray.t_min, nearest.t, found) && (found.t < nearest.t || nearest.triangle == NO_HIT)) {
        engine_hits[i] = Hit(found.t, found.barycentrics, push.triangle);
    }
}
