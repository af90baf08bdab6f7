// Light from triangles, points, spots and directions, and the weights that combine sampling strategies.
//
// Sources: spot falloff of the glTF extension KHR_lights_punctual; heuristics of Veach (1997, 9.2).
// Guarantees: densities are per solid angle at the receiver; a light seen edge-on has density and radiance zero, never infinity.
#ifndef CLERESTORY_TRANSPORT_LIGHTS_GLSL
#define CLERESTORY_TRANSPORT_LIGHTS_GLSL

#include "transport/warp.glsl"

// KHR_lights_punctual's least difference of the cosines of the cone angles.
const float SPOT_COS_RANGE_MIN = 0.001;

// Uniform point of a triangle given by a vertex and its two edges.
vec3 triangle_point(vec3 p0, vec3 e1, vec3 e2, vec2 u) {
    vec3 b = square_to_triangle(u);
    return p0 + b.y * e1 + b.z * e2;
}

// Density per solid angle of a density per area, at distance d under the emitter's |cos|; zero edge-on.
float area_to_solid_angle(float pdf_area, float distance_squared, float cos_emitter) {
    return cos_emitter > 0.0 ? pdf_area * distance_squared / cos_emitter : 0.0;
}

// Share of a spot light's axial intensity at an angle to its axis.
float spot_falloff(float cos_angle, float cos_inner, float cos_outer) {
    float scale = 1.0 / max(SPOT_COS_RANGE_MIN, cos_inner - cos_outer);
    float a = clamp((cos_angle - cos_outer) * scale, 0.0, 1.0);
    return a * a;
}

// Weight of the strategy with density a against one with density b; a may be infinite or both zero.
float balance_heuristic(float a, float b) { return a > 0.0 ? 1.0 / (1.0 + b / a) : 0.0; }

float power_heuristic(float a, float b) {
    float r = b / a;
    return a > 0.0 ? 1.0 / (1.0 + r * r) : 0.0;
}

#endif
