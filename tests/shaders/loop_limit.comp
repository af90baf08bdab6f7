#version 460
// Counts how many iterations of one loop a driver really runs: asked for more than some have, they end the loop without a word.
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

layout(set = 0, binding = 0, scalar) restrict writeonly buffer LoopCounts { uint counts[]; };

layout(push_constant, scalar) uniform Push {
    uint iterations;
    uint inner_iterations;  // of a loop within the loop; 0: one loop alone
    uint modulus;           // keeps compilers from working the count out beforehand
} push;

void main() {
    uint count = 0u;
    uint state = gl_GlobalInvocationID.x;
    if (push.inner_iterations == 0u) {
        for (uint i = 0u; i < push.iterations; ++i) {
            state = state * 1664525u + 1013904223u;
            count += state % push.modulus == push.modulus ? 0u : 1u;
        }
        counts[gl_GlobalInvocationID.x] = count;
        return;
    }
    for (uint i = 0u; i < push.iterations; ++i) {
        for (uint j = 0u; j < push.inner_iterations; ++j) {
            state = state * 1664525u + 1013904223u;
            count += state % push.modulus == push.modulus ? 0u : 1u;
        }
    }
    counts[gl_GlobalInvocationID.x] = count;
}
