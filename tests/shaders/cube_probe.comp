#version 460
// What a cube's faces hold, seen from its centre: one invocation a face, in the order +x, -x, +y, -y, +z, -z.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 6) in;

layout(set = 0, binding = 0) uniform samplerCube cube;

layout(set = 0, binding = 1, scalar) writeonly buffer Seen {
    vec4 seen[];
};

void main() {
    uint face = gl_LocalInvocationIndex;
    vec3 axis = vec3(equal(uvec3(face / 2u), uvec3(0u, 1u, 2u)));
    vec3 direction = (face & 1u) == 0u ? axis : -axis;
    seen[face] = textureLod(cube, direction, 0.0);
}
