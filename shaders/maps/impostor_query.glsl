// Rays of batches through maps.
#ifndef CLERESTORY_MAPS_IMPOSTOR_QUERY_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_QUERY_GLSL

// Texels of two numbers that a ray has in a texel buffer.
const uint IMPOSTOR_QUERY_TEXELS = 3u;

// A ray with a unit direction, from the map's place, or of several maps in the axes of their places.
struct ImpostorQuery {
    vec3 origin;
    vec3 direction;
};

// The ray of its texels.
ImpostorQuery impostor_query(vec2 first, vec2 second, vec2 third) {
    return ImpostorQuery(vec3(first, second.x), vec3(second.y, third));
}

#endif
