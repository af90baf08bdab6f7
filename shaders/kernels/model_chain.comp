// One invocation follows a chain of indices: each load waits for the one before it, so the time of a step is the latency of a load.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 1) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer ModelChain { uint model_chain[]; };
// Where the walk stands; it goes on from there.
layout(set = 0, binding = 1, scalar) restrict buffer ModelPlace { uint model_place; };

layout(push_constant, scalar) uniform ModelChainPush { uint steps; } push;

void main() {
    uint place = model_place;
    for (uint i = 0u; i < push.steps; ++i) {
        place = model_chain[place];
    }
    model_place = place;
}
