// Closest-hit and any-hit traversal by the driver: its acceleration structure holds a box for each triangle, and a ray query names those that a ray
// may meet. clerestory::accel::driver says how far the boxes are grown, and why no hit is lost.
//
// Boxes come in an order of the driver's own. What is met depends neither on it nor on boxes that come for nothing: the triangle test decides, and
// of all that pass it the least t counts, of equal ones the least triangle index.
//
// A ray query cannot be stopped and gone on with, and need not be: its loops are the driver's, but for an iteration a box here. Rays from beyond the
// reach that the boxes are grown for try all triangles instead, stop at the quota as those of other indexes do, and go on with the triangle that is
// returned. They, too, take an iteration a triangle, so that no ray takes more than there are triangles.
//
// With CLERESTORY_CANDIDATE_FILTER defined, as a constant that says whether there is a filter, the includer provides, before this file, a pure
//   bool accept_candidate(uint triangle, vec2 barycentrics);
#ifndef CLERESTORY_ACCEL_DRIVER_GLSL
#define CLERESTORY_ACCEL_DRIVER_GLSL

#include "accel/box_test.glsl"
#include "accel/driver_bindings.glsl"
#include "accel/triangle.glsl"

// Instances that a ray sees: all.
const uint DRIVER_MASK = 0xFFu;

// Takes the triangle at a place for the hit if it is better; whether it is.
bool driver_try(RayShear shear, float t_min, uint place, inout Hit hit) {
    INDEX_COUNT_ONE(triangles)
    uint texel = DRIVER_HEADER_TEXELS + DRIVER_TRIANGLE_TEXELS * place;
    vec4 q0 = uintBitsToFloat(driver_texel(texel));
    vec4 q1 = uintBitsToFloat(driver_texel(texel + 1u));
    uvec4 q2 = driver_texel(texel + 2u);
    TriangleHit candidate;
    bool better = intersect_triangle(shear, q0.xyz, vec3(q0.w, q1.xy), vec3(q1.zw, uintBitsToFloat(q2.x)), t_min, hit.t, candidate)
               && (candidate.t < hit.t || q2.y < hit.triangle);
#ifdef CLERESTORY_CANDIDATE_FILTER
    if (CLERESTORY_CANDIDATE_FILTER && better) {
        better = accept_candidate(q2.y, candidate.barycentrics);
    }
#endif
    if (better) {
        hit = Hit(candidate.t, candidate.barycentrics, q2.y);
    }
    return better;
}

// Tries all triangles from a place on. Returns INDEX_FINISHED, or the place to go on with.
uint driver_try_all(Ray ray, RayShear shear, uint place, uint count, const bool any_hit, inout Hit hit) {
    uint iterations = 0u;
    do {
        ++iterations;
        bool better = driver_try(shear, ray.t_min, place, hit);
        place = any_hit && better ? count : place + 1u;
    } while (place < count && iterations < INDEX_QUOTA);
    index_iterations += iterations;
    return place < count ? place : INDEX_FINISHED;
}

// Tries the triangles whose boxes the driver finds along the ray. `origin` is that of the structure's coordinates.
void driver_query(Ray ray, RayShear shear, vec3 origin, const bool any_hit, inout Hit hit) {
    // No component is zero, as in box_test.
    vec3 away = vec3(largest_component(abs(ray.direction)) * MIN_RELATIVE_COMPONENT);
    vec3 direction = mix(vec3(1.0), vec3(-1.0), lessThan(ray.direction, vec3(0.0))) * max(abs(ray.direction), away);
    uint iterations = 0u;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, driver_boxes, gl_RayFlagsNoneEXT, DRIVER_MASK, ray.origin - origin, min(ray.t_min, FAR_AWAY), direction,
                          min(hit.t, FAR_AWAY));
    while (rayQueryProceedEXT(query)) {
        ++iterations;
        uint place = uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, false));
        if (driver_try(shear, ray.t_min, place, hit)) {
            // Boxes that begin behind it need not come any more.
            rayQueryGenerateIntersectionEXT(query, hit.t);
            if (any_hit) {
                rayQueryTerminateEXT(query);
            }
        }
    }
    index_iterations += iterations;
}

// Traverses from `resume` on (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first). Returns INDEX_FINISHED or where to go on.
uint driver_traverse(Ray ray, uint resume, const bool any_hit, inout Hit hit) {
    uvec4 header0 = driver_texel(0u);
    uvec4 header1 = driver_texel(1u);
    uint count = header1.w;
    // Drivers take rays of a length alone.
    if (resume == INDEX_FINISHED || count == 0u || !is_traceable(ray) || !(ray.t_min <= hit.t)) {
        return INDEX_FINISHED;
    }
    RayShear shear = ray_shear(ray.origin, ray.direction);
    vec3 lower = uintBitsToFloat(header0.xyz);
    vec3 upper = uintBitsToFloat(header1.xyz);
    float reach = largest_component(max(abs(lower - ray.origin), abs(upper - ray.origin)));
    uint next = INDEX_FINISHED;
    uint before = index_iterations;
    // Drivers take no rays that begin behind their origin.
    if (reach > uintBitsToFloat(header0.w) || ray.t_min < 0.0) {
        next = driver_try_all(ray, shear, INDEX_RESUMES ? resume : 0u, count, any_hit, hit);
    } else {
        driver_query(ray, shear, uintBitsToFloat(driver_texel(2u).xyz), any_hit, hit);
    }
    if (INDEX_COUNT) {
        index_counters.iterations += index_iterations - before;
    }
    return next;
}

#endif
