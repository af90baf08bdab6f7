// The dual paraboloid map. Sources and guarantees: maps/paraboloid.rs.
#ifndef CLERESTORY_MAPS_PARABOLOID_GLSL
#define CLERESTORY_MAPS_PARABOLOID_GLSL

// On the unit disc of a layer, 1 for z < 0, of a unit direction.
vec2 paraboloid_encode(vec3 d, out uint layer) {
    layer = d.z < 0.0 ? 1u : 0u;
    return d.xy / (1.0 + abs(d.z));
}

// Beyond the rim it goes on into the other half.
vec3 paraboloid_decode(uint layer, vec2 uv) {
    float squared = dot(uv, uv);
    return vec3(2.0 * uv, layer == 0u ? 1.0 - squared : squared - 1.0) / (1.0 + squared);
}

// Solid angle over area of the disc.
float paraboloid_density(vec2 uv) {
    float h = 1.0 + dot(uv, uv);
    return 4.0 / (h * h);
}

#endif
