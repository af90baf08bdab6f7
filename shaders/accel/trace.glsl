// The trace kernel, a ray per invocation.
#ifndef CLERESTORY_ACCEL_TRACE_GLSL
#define CLERESTORY_ACCEL_TRACE_GLSL

#include "accel/trace_ray.glsl"

layout(local_size_x = 64) in;

void main() {
    if (gl_GlobalInvocationID.x < trace_constants.ray_count) {
        trace_account(trace_ray(trace_constants.first_ray + gl_GlobalInvocationID.x));
    }
}

#endif
