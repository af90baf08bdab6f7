// What boxes and planes are met by: origin, clamped reciprocal direction, and the slack by which boxes are grown. Twin of
// clerestory::accel::box_test::BoxTest; BOX_SLACK is derived beside its Rust name.
#ifndef CLERESTORY_ACCEL_BOX_TEST_GLSL
#define CLERESTORY_ACCEL_BOX_TEST_GLSL

#include "accel/ray.glsl"

const float BOX_SLACK = 1.0 / 262144.0;
const float MIN_RELATIVE_COMPONENT = 8.6736174e-19;

struct BoxTest {
    vec3 origin;
    vec3 inverse;
    vec3 slack;
};

float clamped_reciprocal(float d, float least) {
    return (d < 0.0 ? -1.0 : 1.0) / max(abs(d), least);
}

// For boxes within the given one.
BoxTest box_test(vec3 lower, vec3 upper, Ray ray) {
    float least = largest_component(abs(ray.direction)) * MIN_RELATIVE_COMPONENT;
    vec3 inverse = vec3(clamped_reciprocal(ray.direction.x, least), clamped_reciprocal(ray.direction.y, least),
                        clamped_reciprocal(ray.direction.z, least));
    float reach = largest_component(max(abs(lower - ray.origin), abs(upper - ray.origin)));
    return BoxTest(ray.origin, inverse, (BOX_SLACK * reach) * abs(inverse));
}

// Entry and exit distance of a box grown by the slack; precise, since spans that are found again must have the same bits.
vec2 box_span(BoxTest test, vec3 lower, vec3 upper) {
    precise vec3 t0 = (lower - test.origin) * test.inverse;
    precise vec3 t1 = (upper - test.origin) * test.inverse;
    precise vec3 near = min(t0, t1) - test.slack;
    precise vec3 far = max(t0, t1) + test.slack;
    return vec2(max(near.x, max(near.y, near.z)), min(far.x, min(far.y, far.z)));
}

#endif
