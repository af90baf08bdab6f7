#version 460
// Writes known values into members of every kind of type, so that a test can read them back through the generated structs.
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8) in;
// What is added to every value.
layout(constant_id = 0) const uint BIAS = 0;
layout(constant_id = 1) const bool NEGATE = false;
layout(constant_id = 2) const float SCALE = 1.0;

struct ProbeInner {
    vec3 direction;
    uint id;
};

struct ProbeRecord {
    float weight;
    ProbeInner inner[2];
    vec2 uv;
    mat3 basis;
    ivec4 flags;
    uint tail;
};

layout(push_constant, scalar) uniform Push {
    vec3 origin;
    uint count;
    ProbeInner inner;
    mat4x3 transform;
};

layout(set = 0, binding = 0, scalar) writeonly buffer ProbeOutput {
    uint header;
    vec3 echo;
    ProbeRecord records[];
};

layout(set = 0, binding = 1, scalar) readonly buffer ProbeInput {
    ProbeInner inputs[];
};

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i == 0) {
        header = count;
        echo = origin + transform[3];
    }
    if (i >= count) {
        return;
    }
    float sign = NEGATE ? -SCALE : SCALE;
    records[i].weight = sign * float(i + BIAS);
    records[i].inner[0] = inputs[i];
    records[i].inner[1] = inner;
    records[i].uv = vec2(1.0, 2.0) * sign;
    records[i].basis = mat3(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
    records[i].flags = ivec4(-1, -2, -3, int(i));
    records[i].tail = 0xC1E2E570u + i;
}
