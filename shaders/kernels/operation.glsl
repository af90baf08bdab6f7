// Operations of scans and reductions over 32-bit words.
#ifndef CLERESTORY_KERNELS_OPERATION_GLSL
#define CLERESTORY_KERNELS_OPERATION_GLSL

const uint OPERATION_SUM = 0u;
const uint OPERATION_MIN = 1u;
const uint OPERATION_MAX = 2u;

const uint LARGEST_WORD = 0xFFFFFFFFu;

#endif
