// Numbers of invocations of dispatches that are too large for one row of workgroups: ComputePipeline::groups_over.
#ifndef CLERESTORY_INVOCATION_GLSL
#define CLERESTORY_INVOCATION_GLSL

// Row by row; of kernels whose workgroups extend along x alone.
uint invocation_index() {
    return gl_GlobalInvocationID.y * gl_NumWorkGroups.x * gl_WorkGroupSize.x + gl_GlobalInvocationID.x;
}

#endif
