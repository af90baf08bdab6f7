// Simple shapes in place of the surroundings of a map, and directions of rays. Sources and bias: maps/impostor/proxy.rs.
#ifndef CLERESTORY_MAPS_PROXY_GLSL
#define CLERESTORY_MAPS_PROXY_GLSL

// Shapes of what stands in for the surroundings.
const uint PROXY_NONE = 0u;
const uint PROXY_SPHERE = 1u;
const uint PROXY_BOX = 2u;
const uint PROXY_HEMISPHERE = 3u;

// Farther than any wall: that of one that a ray runs along.
const float PROXY_FAR = 3e38;

// Distance along a ray from x in the unit direction r to where it leaves the sphere about the map's place.
float sphere_proxy(vec3 x, vec3 r, float radius) {
    float along = dot(x, r);
    vec3 aside = x - along * r;
    return max(sqrt(max(radius * radius - dot(aside, aside), 0.0)) - along, 0.0);
}

// The same of a box.
float box_proxy(vec3 x, vec3 r, vec3 low, vec3 high) {
    vec3 walls = mix(high, low, lessThan(r, vec3(0.0)));
    vec3 far = mix((walls - x) / r, vec3(PROXY_FAR), equal(r, vec3(0.0)));
    return max(min(far.x, min(far.y, far.z)), 0.0);
}

// Height of a hemisphere above x.
float hemisphere_proxy(vec3 x, vec3 up, float radius) {
    float height = dot(x, up);
    vec3 aside = x - height * up;
    return max(sqrt(max(radius * radius - dot(aside, aside), 0.0)) - height, 0.0);
}

vec3 mirrored(vec3 d, vec3 n) { return d - 2.0 * dot(n, d) * n; }

// Into a body, or mirrored where all light is reflected.
vec3 refracted(vec3 d, vec3 n, float ratio) {
    float cos_i = dot(n, d);
    float k = 1.0 - ratio * ratio * (1.0 - cos_i * cos_i);
    return k < 0.0 ? mirrored(d, n) : ratio * d - (ratio * cos_i + sqrt(k)) * n;
}

#endif
