// Rays and hits as every index and trace kernel uses them; twins of clerestory::accel::{Ray, Hit}. Scalar layout: 32 and 16 bytes.
#ifndef CLERESTORY_ACCEL_RAY_GLSL
#define CLERESTORY_ACCEL_RAY_GLSL

struct Ray {
    vec3 origin;
    float t_min;
    vec3 direction;
    float t_max;
};

struct Hit {
    float t;
    vec2 barycentrics;
    uint triangle;
};

const uint NO_HIT = 0xFFFFFFFFu;
const float MAX_DIRECTION = 268435456.0;
const float MIN_DIRECTION = 1.0 / MAX_DIRECTION;
const float MAX_COORDINATE = 1073741824.0;
// A distance beyond every scene: coordinates are below 2^30 m.
const float FAR_AWAY = 3.0e38;

Hit no_hit(float t_max) {
    return Hit(t_max, vec2(0.0), NO_HIT);
}

float largest_component(vec3 v) {
    return max(v.x, max(v.y, v.z));
}

// Finite and in range. Comparisons are ordered, so NaN fails the first two before the maximum could see it.
bool is_traceable(Ray ray) {
    return all(lessThanEqual(abs(ray.origin), vec3(MAX_COORDINATE)))
        && all(lessThanEqual(abs(ray.direction), vec3(MAX_DIRECTION)))
        && largest_component(abs(ray.direction)) >= MIN_DIRECTION;
}

#endif
