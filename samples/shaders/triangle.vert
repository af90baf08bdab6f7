#version 460
// Places the corners of a triangle pulled from a storage buffer.
#extension GL_EXT_scalar_block_layout : require

struct TriangleVertex {
    vec2 position;
    vec3 color;
};

layout(push_constant, scalar) uniform Push {
    // Cosine and sine of the turn.
    vec2 rotation;
};

layout(set = 0, binding = 0, scalar) readonly buffer Vertices {
    TriangleVertex vertices[];
};

layout(location = 0) out vec3 tint;

void main() {
    vec2 p = vertices[gl_VertexIndex].position;
    gl_Position = vec4(rotation.x * p.x - rotation.y * p.y, rotation.y * p.x + rotation.x * p.y, 0.5, 1.0);
    tint = vertices[gl_VertexIndex].color;
}
