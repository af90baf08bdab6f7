#version 460
// A colour of a table, chosen by push constants.
#extension GL_EXT_scalar_block_layout : require

layout(push_constant, scalar) uniform Push {
    vec2 low;
    vec2 high;
    float depth;
    uint color;
};

layout(set = 0, binding = 0, scalar) readonly buffer Palette {
    vec4 palette[];
};

layout(location = 0) out vec4 result;

void main() {
    result = palette[color];
}
