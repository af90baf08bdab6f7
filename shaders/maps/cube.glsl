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

// The point of a face's coordinates in space, at a height along its normal.
vec3 cube_point(uint face, vec2 uv, float height) {
    float side = (face & 1u) == 0u ? 1.0 : -1.0;
    return face >= 4u ? vec3(side * uv.x, -uv.y, side * height)
         : face >= 2u ? vec3(uv.x, side * height, side * uv.y)
                      : vec3(side * height, -uv.y, -side * uv.x);
}

vec3 cube_decode(uint face, vec2 uv) { return normalize(cube_point(face, uv, 1.0)); }

// Solid angle over area of the face.
float cube_density(vec2 uv) {
    float r = inversesqrt(1.0 + dot(uv, uv));
    return r * r * r;
}

#endif
