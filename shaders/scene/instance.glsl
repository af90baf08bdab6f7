// Images of vertices under an instance's transform; twins of clerestory::accel::two_level::transform. `precise`, since triangles that share a vertex must
// share its image to the bit, whichever kernel makes it.
#ifndef CLERESTORY_SCENE_INSTANCE_GLSL
#define CLERESTORY_SCENE_INSTANCE_GLSL

// The mesh is where it is: images are its vertices.
const uint INSTANCE_IDENTITY = 1u;
// Fronts become backs, which swapped corners undo.
const uint INSTANCE_MIRRORED = 2u;
// Steps of a search among instances: there are at most 2 to the power of it.
const uint INSTANCE_SEARCH_STEPS = 20u;

// A row times a vector, from left to right.
float instance_row(vec3 row, vec3 v) {
    precise float sum = row.x * v.x + row.y * v.y + row.z * v.z;
    return sum;
}

vec3 instance_rows(vec3 x, vec3 y, vec3 z, vec3 v) {
    return vec3(instance_row(x, v), instance_row(y, v), instance_row(z, v));
}

vec3 instance_vertex(vec3 x, vec3 y, vec3 z, vec3 translation, vec3 vertex) {
    precise vec3 image = instance_rows(x, y, z, vertex) + translation;
    return image;
}

#endif
