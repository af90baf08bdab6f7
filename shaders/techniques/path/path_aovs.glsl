// What paths keep of the first surface that they see.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_AOVS_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_AOVS_GLSL

// descriptor set 1: PathAovSet

struct PathAov {
    vec3 albedo;
    float depth;  // distance along the ray; 0 without a hit
    vec3 normal;
    uint filled;
};

layout(set = 1, binding = 0, scalar) restrict buffer PathAovs { PathAov path_aovs[]; };  // by slot

#endif
