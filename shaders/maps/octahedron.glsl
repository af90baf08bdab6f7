// Octahedron maps: square layout in [-1, 1]^2 and rectangular layout in [-2, 2] x [-1, 1]. Sources and guarantees: maps/octahedron.rs.
#ifndef CLERESTORY_MAPS_OCTAHEDRON_GLSL
#define CLERESTORY_MAPS_OCTAHEDRON_GLSL

// The sign of zero is +1: with 0, half of the map would fall together.
vec2 octahedron_signs(vec2 v) { return vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0); }

// Of a direction of any length, onto |x| + |y| + c |z| = 1.
vec2 octahedron_perspective_encode(vec3 d, float c) {
    vec2 p = d.xy / (abs(d.x) + abs(d.y) + c * abs(d.z));
    return d.z < 0.0 ? (1.0 - abs(p.yx)) * octahedron_signs(p) : p;
}

vec2 octahedron_encode(vec3 d) { return octahedron_perspective_encode(d, 1.0); }

vec3 octahedron_point(vec2 uv, float c) {
    float h = 1.0 - abs(uv.x) - abs(uv.y);
    return vec3(uv - octahedron_signs(uv) * max(-h, 0.0), h / c);
}

vec3 octahedron_perspective_decode(vec2 uv, float c) { return normalize(octahedron_point(uv, c)); }

vec3 octahedron_decode(vec2 uv) { return octahedron_perspective_decode(uv, 1.0); }

// Solid angle over area.
float octahedron_perspective_density(vec2 uv, float c) {
    vec3 p = octahedron_point(uv, c);
    float r = inversesqrt(dot(p, p));
    return r * r * r / c;
}

float octahedron_density(vec2 uv) { return octahedron_perspective_density(uv, 1.0); }

vec2 octahedron_rectangular_encode(vec3 d) {
    vec2 p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    return vec2(d.z < 0.0 ? 1.0 - (p.x - p.y) : p.x - p.y - 1.0, p.x + p.y);
}

vec3 octahedron_rectangular_point(vec2 uv) {
    float along = uv.x < 0.0 ? uv.x + 1.0 : 1.0 - uv.x;
    vec2 p = 0.5 * vec2(along + uv.y, uv.y - along);
    float h = 1.0 - abs(p.x) - abs(p.y);
    return vec3(p, uv.x < 0.0 ? h : -h);
}

vec3 octahedron_rectangular_decode(vec2 uv) { return normalize(octahedron_rectangular_point(uv)); }

float octahedron_rectangular_density(vec2 uv) {
    vec3 p = octahedron_rectangular_point(uv);
    float r = inversesqrt(dot(p, p));
    return 0.5 * r * r * r;
}

#endif
