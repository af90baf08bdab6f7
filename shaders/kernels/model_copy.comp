// Copies a buffer, sixteen bytes per invocation.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 256) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer ModelFrom { uvec4 model_from[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer ModelTo { uvec4 model_to[]; };

layout(push_constant, scalar) uniform ModelCopyPush { uint count; } push;

void main() {
    if (gl_GlobalInvocationID.x < push.count) {
        model_to[gl_GlobalInvocationID.x] = model_from[gl_GlobalInvocationID.x];
    }
}
