// The sphere map (mirror ball). Sources and guarantees: maps/sphere_map.rs.
#ifndef CLERESTORY_MAPS_SPHERE_MAP_GLSL
#define CLERESTORY_MAPS_SPHERE_MAP_GLSL

// On the unit disc, of a unit direction; (1, 0) for (0, 0, -1).
vec2 sphere_map_encode(vec3 d) {
    if (d.z >= 0.0) {
        return d.xy * inversesqrt(2.0 * (1.0 + d.z));
    }
    // Behind, 1 + z = (x^2 + y^2) / (1 - z), which does not cancel.
    float r = length(d.xy);
    return (r > 0.0 ? d.xy / r : vec2(1.0, 0.0)) * sqrt(0.5 * (1.0 - d.z));
}

// Outside of the disc as at its rim.
vec3 sphere_map_decode(vec2 uv) {
    float squared = max(1.0 - dot(uv, uv), 0.0);
    return vec3(2.0 * sqrt(squared) * uv, 2.0 * squared - 1.0);
}

// Solid angle over area of the disc.
float sphere_map_density(vec2 uv) { return 4.0; }

#endif
