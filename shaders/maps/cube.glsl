// The cube map, with the faces and axes of cube images. Sources and guarantees: maps/cube.rs.
#ifndef CLERESTORY_MAPS_CUBE_GLSL
#define CLERESTORY_MAPS_CUBE_GLSL

const uint CUBE_FACES = 6u;

// In [-1, 1]^2 of a face, of a direction of any length. Of equal components z counts before y before x.
vec2 cube_encode(vec3 d, out uint face) {
    vec3 a = abs(d);
    bool is_z = a.z >= a.x && a.z >= a.y;
    bool is_y = !is_z && a.y >= a.x;
    float along = is_z ? d.z : is_y ? d.y : d.x;
    float side = along < 0.0 ? -1.0 : 1.0;
    face = (is_z ? 4u : is_y ? 2u : 0u) + (along < 0.0 ? 1u : 0u);
    // Chosen before it is divided: where lanes choose differently, all of them pay for each division.
    vec2 aside = is_z ? vec2(side * d.x, -d.y) : is_y ? vec2(d.x, side * d.z) : vec2(-side * d.z, -d.y);
    return aside / abs(along);
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
