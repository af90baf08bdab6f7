#version 460
// A rectangle of two triangles at a depth, both told by push constants.
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push {
    vec2 low;
    vec2 high;
    float depth;
    uint color;
};

void main() {
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    gl_Position = vec4(mix(low, high, corner), depth, 1.0);
}
