// Warps from the unit square to the domains that a renderer samples, with their densities.
//
// Sources: concentric disk of Shirley and Chiu (1997); triangle of Heitz, "A Low-Distortion Map Between Triangle and Square" (2019);
// linear densities in the stable form of Pharr et al. (2023, 2.3.2).
// Guarantees: densities integrate to one over their domain (solid angle for directions); directions have unit length.
#ifndef CLERESTORY_TRANSPORT_WARP_GLSL
#define CLERESTORY_TRANSPORT_WARP_GLSL

#include "pi.glsl"
#include "scene/normal_map.glsl"
#include "transport/choice.glsl"

const float UNIFORM_SPHERE_PDF = 0.07957747154594766788;
const float UNIFORM_HEMISPHERE_PDF = 0.15915494309189533577;
// Keeps a quotient of zeros zero.
const float LINEAR_LEAST = 1e-30;

// Point of the unit disk; density 1/pi.
vec2 square_to_disk(vec2 u) {
    vec2 p = 2.0 * u - 1.0;
    bool wide = abs(p.x) > abs(p.y);
    float r = wide ? p.x : p.y;
    float ratio = r == 0.0 ? 0.0 : (wide ? p.y : p.x) / r;
    float phi = ratio * (0.25 * PI);
    return r * (wide ? vec2(cos(phi), sin(phi)) : vec2(sin(phi), cos(phi)));
}

// Direction about +z with density cos/pi.
vec3 square_to_cosine_hemisphere(vec2 u) {
    vec2 p = square_to_disk(u);
    return vec3(p, sqrt(max(0.0, 1.0 - dot(p, p))));
}

float cosine_hemisphere_pdf(float cos_theta) { return max(cos_theta, 0.0) * INV_PI; }

// Direction at height 1 - d, where d is spread evenly: the common end of the warps to sphere, hemisphere and cone.
vec3 direction_below_pole(float d, float u) {
    float r = sqrt(max(0.0, d * (2.0 - d)));
    float phi = 2.0 * PI * u;
    return vec3(r * cos(phi), r * sin(phi), 1.0 - d);
}

// Uniform direction; density UNIFORM_SPHERE_PDF.
vec3 square_to_sphere(vec2 u) { return direction_below_pole(2.0 * u.x, u.y); }

// Uniform direction with z >= 0; density UNIFORM_HEMISPHERE_PDF.
vec3 square_to_hemisphere(vec2 u) { return direction_below_pole(u.x, u.y); }

// Uniform direction in the cone about +z; one_minus_cos = 1 - cos(half angle), which stays exact for thin cones.
vec3 square_to_cone(vec2 u, float one_minus_cos) { return direction_below_pole(one_minus_cos * u.x, u.y); }

float cone_pdf(float one_minus_cos) { return 1.0 / (2.0 * PI * one_minus_cos); }

// Barycentric weights (of vertices 0, 1, 2) of a uniform point of a triangle; density 1/area.
vec3 square_to_triangle(vec2 u) {
    float low = 0.5 * min(u.x, u.y);
    vec2 b = u.x < u.y ? vec2(low, u.y - low) : vec2(u.x - low, low);
    return vec3(1.0 - b.x - b.y, b);
}

// Number in [0, 1) whose density changes linearly from one end to the other, where it is in proportion to a and b; not both are zero.
float linear_sample(float u, float a, float b) {
    // Scaled, so that no square overflows.
    float most = max(a, b);
    a /= most;
    b /= most;
    return min(u * (a + b) / max(a + sqrt(mix(a * a, b * b, u)), LINEAR_LEAST), BELOW_ONE);
}

#endif
