// What the kernels that compare shader functions with their Rust twins share: cases in, results out (set 0). Integers travel as bits.
#ifndef CLERESTORY_TESTS_TWIN_INTERFACE_GLSL
#define CLERESTORY_TESTS_TWIN_INTERFACE_GLSL

layout(local_size_x = 64) in;

// Numbers of a case and of its results.
const uint TWIN_INPUTS = 32u;
const uint TWIN_OUTPUTS = 16u;

layout(set = 0, binding = 0, scalar) restrict readonly buffer TwinInputs { float twin_inputs[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer TwinOutputs { float twin_outputs[]; };
layout(set = 0, binding = 2, scalar) restrict readonly buffer TwinTable { float twin_table[]; };

layout(push_constant, scalar) uniform Push {
    uint function;
    uint case_count;
} push;

uint twin_case() { return gl_GlobalInvocationID.x; }
float in1(uint i) { return twin_inputs[twin_case() * TWIN_INPUTS + i]; }
vec2 in2(uint i) { return vec2(in1(i), in1(i + 1u)); }
vec3 in3(uint i) { return vec3(in2(i), in1(i + 2u)); }
vec4 in4(uint i) { return vec4(in3(i), in1(i + 3u)); }
uint in_bits(uint i) { return floatBitsToUint(in1(i)); }

void out1(uint i, float x) { twin_outputs[twin_case() * TWIN_OUTPUTS + i] = x; }
void out2(uint i, vec2 x) {
    out1(i, x.x);
    out1(i + 1u, x.y);
}
void out3(uint i, vec3 x) {
    out2(i, x.xy);
    out1(i + 2u, x.z);
}
void out_bits(uint i, uint x) { out1(i, uintBitsToFloat(x)); }

#endif
