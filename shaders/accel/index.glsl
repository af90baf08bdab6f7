// The ray index that a kernel traverses: closest_hit and any_hit by the kind that it is specialized to; the others compile to nothing.
//
// A module with ray queries is no module for devices without them. So an entry file with the line `// variant: driver` is compiled a second time, with
// CLERESTORY_INDEX_DRIVER defined, for the driver's acceleration structure.
//
// A call goes on from `resume` (INDEX_START at first), improving `hit` (no_hit(ray.t_max) at first), and returns INDEX_FINISHED or where to
// go on.
#ifndef CLERESTORY_ACCEL_INDEX_GLSL
#define CLERESTORY_ACCEL_INDEX_GLSL

const uint INDEX_BVH2 = 0u;
const uint INDEX_KD = 1u;
const uint INDEX_WIDE = 2u;
const uint INDEX_DRIVER = 3u;
const uint INDEX_TWO_LEVEL = 4u;

#ifdef CLERESTORY_INDEX_DRIVER

#include "accel/driver.glsl"

#define INDEX_KIND INDEX_DRIVER

uint closest_hit(Ray ray, uint resume, inout Hit hit) { return driver_traverse(ray, resume, false, hit); }

uint any_hit(Ray ray, uint resume, inout Hit hit) { return driver_traverse(ray, resume, true, hit); }

#else

#include "accel/bvh2.glsl"
#include "accel/kd.glsl"
#include "accel/two_level.glsl"
#include "accel/wide.glsl"

layout(constant_id = 102) const uint INDEX_KIND = INDEX_BVH2;

// Candidate of least t, of equal ones that of least triangle index.
uint closest_hit(Ray ray, uint resume, inout Hit hit) {
    if (INDEX_KIND == INDEX_KD) {
        return kd_traverse(ray, resume, false, hit);
    }
    if (INDEX_KIND == INDEX_WIDE) {
        return wide_traverse(ray, resume, false, hit);
    }
    if (INDEX_KIND == INDEX_TWO_LEVEL) {
        return two_level_traverse(ray, resume, false, hit);
    }
    return bvh2_traverse(ray, resume, false, hit);
}

// Ends at the first candidate; occluded once the hit has a triangle, which may be any of those met.
uint any_hit(Ray ray, uint resume, inout Hit hit) {
    if (INDEX_KIND == INDEX_KD) {
        return kd_traverse(ray, resume, true, hit);
    }
    if (INDEX_KIND == INDEX_WIDE) {
        return wide_traverse(ray, resume, true, hit);
    }
    if (INDEX_KIND == INDEX_TWO_LEVEL) {
        return two_level_traverse(ray, resume, true, hit);
    }
    return bvh2_traverse(ray, resume, true, hit);
}

#endif
#endif
