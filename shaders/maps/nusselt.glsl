// Nusselt's map of the hemisphere about z. Sources and guarantees: maps/nusselt.rs.
#ifndef CLERESTORY_MAPS_NUSSELT_GLSL
#define CLERESTORY_MAPS_NUSSELT_GLSL

// On the unit disc, of a unit direction with z >= 0.
vec2 nusselt_encode(vec3 d) { return d.xy; }

// Outside of the disc on the horizon.
vec3 nusselt_decode(vec2 uv) {
    float squared = dot(uv, uv);
    return vec3(uv, sqrt(max(1.0 - squared, 0.0))) * inversesqrt(max(squared, 1.0));
}

// Solid angle over area of the disc.
float nusselt_density(vec2 uv) { return inversesqrt(max(1.0 - dot(uv, uv), 0.0)); }

#endif
