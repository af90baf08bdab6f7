// The fence about an arrival at a node: what was written before is seen by who arrives second.
#ifndef CLERESTORY_ACCEL_LBVH_FENCE_GLSL
#define CLERESTORY_ACCEL_LBVH_FENCE_GLSL

// Whether what is written is made visible before and after an arrival; the atomic operation itself orders nothing in Vulkan. Lavapipe of
// Mesa 22.3 takes a memory barrier for one of the whole workgroup, and cuts short what the other invocations do not reach; but it compiles
// atomic operations to sequentially consistent instructions, which order what an invocation writes before and reads after them.
layout(constant_id = 1) const bool LBVH_FENCES = true;

void lbvh_fence() {
    if (LBVH_FENCES) {
        memoryBarrierBuffer();
    }
}

#endif
