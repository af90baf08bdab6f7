// Where normals are interpolated, light's power is scattered otherwise than radiance (Veach 1997, 5.3.2).
#ifndef CLERESTORY_TRANSPORT_ADJOINT_RATIO_GLSL
#define CLERESTORY_TRANSPORT_ADJOINT_RATIO_GLSL

// The ratio by which power that leaves for wi falls short of what interpolated normals make of radiance.
float adjoint_ratio(vec3 normal, vec3 geometric_normal, vec3 wo, vec3 wi) {
    float shown = abs(dot(wo, geometric_normal) * dot(wi, normal));
    return shown > 0.0 ? abs(dot(wo, normal) * dot(wi, geometric_normal)) / shown : 0.0;
}

#endif
