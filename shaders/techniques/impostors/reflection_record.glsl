// What is kept of a ray whose end a map showed.
#ifndef CLERESTORY_TECHNIQUES_IMPOSTORS_REFLECTION_RECORD_GLSL
#define CLERESTORY_TECHNIQUES_IMPOSTORS_REFLECTION_RECORD_GLSL

// Kinds of rays.
const uint REFLECTION_NONE = 0u;
const uint REFLECTION_MIRRORED = 1u;
const uint REFLECTION_REFRACTED = 2u;

// A ray from the map's place, and where it was looked up.
struct ReflectionRecord {
    vec3 origin;
    float residual;
    vec3 direction;
    uint kind;
    vec3 found;
    vec3 start;  // off its surface, in the scene: where the path tracer's ray begins
};

#endif
