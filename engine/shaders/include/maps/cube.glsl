// The cube map, with the faces and axes of cube images. Sources and guarantees: maps/cube.rs.
#ifndef CLERESTORY_MAPS_CUBE_GLSL
#define CLERESTORY_MAPS_CUBE_GLSL

const uint CUBE_FACES = 6u;

// In [-1, 1]^2 of a face, of a direction of any length. Of equal components z counts before y before x.
vec2 cube_encode(vec3 d, out uint face) {
    vec3 a = abs(d);
    if (a.z >= a.x && a.z >= a.y) {
        face = d.z < 0.0 ? 5u : 4u;
        return vec2(d.x / d.z, -d.y / a.z);
    }
    if (a.y >= a.x) {
        face = d.y < 0.0 ? 3u : 2u;
        return vec2(d.x / a.y, d.z / d.y);
    }
    face = d.x < 0.0 ? 1u : 0u;
    return vec2(-d.z / d.x, -d.y / a.x);
}

vec3 cube_decode(uint face, vec2 uv) {
    float side = (face & 1u) == 0u ? 1.0 : -1.0;
    vec3 p = face >= 4u ? vec3(side * uv.x, -uv.y, side)
           : face >= 2u ? vec3(uv.x, side, side * uv.y)
                        : vec3(side, -uv.y, -side * uv.x);
    return normalize(p);
}

// Solid angle over area of the face.
float cube_density(vec2 uv) {
    float r = inversesqrt(1.0 + dot(uv, uv));
    return r * r * r;
}

#endif
