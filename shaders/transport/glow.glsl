// Where light starts in media that emit: a source for each of them, and the bodies that tell which medium a place is in. Filled by
// clerestory::transport::GpuScene.
#ifndef CLERESTORY_TRANSPORT_GLOW_GLSL
#define CLERESTORY_TRANSPORT_GLOW_GLSL

// Places of a grid that are tried, in search of one where light starts.
const uint GLOW_TRIES = 16u;

struct GlowSource {
    vec3 corner;        // of a parallelepiped that holds all of the medium that emits, m
    float until;        // probability of this source and of those before it
    vec3 edge_x;        // m
    uint medium;
    vec3 edge_y;
    float side;         // of a cube as large, m
    vec3 edge_z;
    float probability;  // of this source
    vec3 power;         // W, over the probabilities of the source and of finding a place in it
    float spare;
};

// Those of least volume come first.
struct GlowBody {
    vec3 lower;      // of the box around it, m
    uint first;      // number of its first triangle
    vec3 upper;
    uint triangles;
    uint material;
    uint medium;     // inside, or NO_MEDIUM
    uvec2 spare;
};

#endif
