// From where the pixels of a G-buffer are seen.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SEEN_GLSL

struct SeenFrom {
    vec3 origin;
    uint width;        // of the picture, pixels
    vec3 right;        // over the picture's half width
    uint height;
    vec3 down;         // over its half height
    uint is_parallel;
    vec3 forward;
};

// Where the ray through a pixel's centre begins, and its unit direction.
vec3 seen_direction(SeenFrom from, uvec2 pixel, out vec3 origin) {
    vec2 place = (2.0 * vec2(pixel) + 1.0) / vec2(from.width, from.height) - 1.0;
    vec3 across = place.x * from.right + place.y * from.down;
    bool parallel = from.is_parallel != 0u;
    origin = from.origin + (parallel ? across : vec3(0.0));
    return normalize(parallel ? from.forward : from.forward + across);
}

#endif
