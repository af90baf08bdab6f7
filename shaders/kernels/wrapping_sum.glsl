// Scans of a workgroup by the sum modulo 2^32: what `team_scan.glsl` wants to know.
#ifndef CLERESTORY_KERNELS_WRAPPING_SUM_GLSL
#define CLERESTORY_KERNELS_WRAPPING_SUM_GLSL

#define TEAM_TYPE uint
#define TEAM_IDENTITY 0u
#define TEAM_COMBINE(earlier, later) ((earlier) + (later))
#include "kernels/team_scan.glsl"

#endif
