// Frames about normals, and normal maps in them.
//
// Sources: basis of Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 6(1), 2017); normal maps of glTF 2.0, 3.9.3.
// Twin of clerestory::scene::normal_map.
#ifndef CLERESTORY_SCENE_NORMAL_MAP_GLSL
#define CLERESTORY_SCENE_NORMAL_MAP_GLSL

// Tangents whose part normal to n is shorter than this are replaced.
const float TANGENT_LENGTH_MIN = 1e-4;

// Tangent and bitangent of a right-handed frame about the unit vector n.
void orthonormal_basis(vec3 n, out vec3 t, out vec3 b) {
    float s = n.z < 0.0 ? -1.0 : 1.0;
    float a = -1.0 / (s + n.z);
    float c = n.x * n.y * a;
    t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
    b = vec3(c, s + n.y * n.y * a, -n.y);
}

// World-space normal of a tangent-space normal map: texel in [0, 1], tangent.w the sign of the bitangent.
vec3 mapped_normal(vec3 n, vec4 tangent, vec3 texel, float scale) {
    vec3 m = (2.0 * texel - 1.0) * vec3(scale, scale, 1.0);
    vec3 t = tangent.xyz - n * dot(n, tangent.xyz);
    vec3 b;
    if (dot(t, t) < TANGENT_LENGTH_MIN * TANGENT_LENGTH_MIN) {
        orthonormal_basis(n, t, b);
    } else {
        t = normalize(t);
        b = cross(n, t) * (tangent.w < 0.0 ? -1.0 : 1.0);
    }
    vec3 mapped = t * m.x + b * m.y + n * m.z;
    float l = dot(mapped, mapped);
    return l > 0.0 ? mapped * inversesqrt(l) : n;
}

#endif
