#version 460
// Every triangle to all of the first layers, whose number is added to the value.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(constant_id = 0) const int LAYERS = 1;

layout(triangles) in;
layout(triangle_strip, max_vertices = 18) out;

layout(location = 0) flat in uint written[];
layout(location = 0) flat out uint written_out;

void main() {
    for (int layer = 0; layer < LAYERS; ++layer) {
        for (int corner = 0; corner < 3; ++corner) {
            gl_Position = gl_in[corner].gl_Position;
            gl_Layer = layer;
            written_out = written[corner] + layer;
            EmitVertex();
        }
        EndPrimitive();
    }
}
