#version 460
// The random numbers of transport/random.glsl for streams that the host names. Words are written as words: bits must not pass through
// floating-point registers that could quieten a NaN.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SAMPLER_KIND = 0;  // SAMPLER_SOBOL, SAMPLER_PCG or SAMPLER_JOINT_SOBOL
#define CLERESTORY_SAMPLER SAMPLER_KIND

#include "transport/random.glsl"

struct RandomCase {
    uint pixel;
    uint sample_index;
    uint dimension;
    uint seed;
};

struct RandomWords {
    uvec2 bits;
    uvec3 pcg3;
    uvec4 pcg4;
    uint scrambled;
    uint pascal;
    float one;
    vec2 two;
    uint next_dimension;
};

layout(set = 0, binding = 0, scalar) restrict readonly buffer RandomCases { RandomCase cases[]; };
layout(set = 0, binding = 1, scalar) restrict writeonly buffer RandomResults { RandomWords results[]; };

layout(push_constant, scalar) uniform Push {
    uint case_count;
} push;

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= push.case_count) {
        return;
    }
    RandomCase c = cases[i];
    Sampler s = Sampler(c.pixel, c.sample_index, c.dimension, c.seed);
    RandomWords r;
    r.bits = sampler_bits(s);
    r.pcg3 = pcg3d(uvec3(c.pixel, c.sample_index, c.dimension));
    r.pcg4 = pcg4d(uvec4(c.pixel, c.sample_index, c.dimension, c.seed));
    r.scrambled = owen_scramble(c.sample_index, c.seed);
    r.pascal = sobol_pascal(c.sample_index);
    r.one = sample_1d(s);
    r.two = sample_2d(s);
    r.next_dimension = s.dimension;
    results[i] = r;
}
