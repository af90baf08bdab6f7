#version 460
// Wavefront path tracer, first stage: camera rays of a wave of pixels × samples, one slot each (slot = pixel × samples + sample, so that the rays of a subgroup
// stay together). path_camera.glsl says what they are.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SAMPLER_KIND = 0;  // SAMPLER_SOBOL, SAMPLER_PCG or SAMPLER_JOINT_SOBOL
layout(constant_id = 28) const bool NUMBERED = false;  // each slot has a pixel and sample of its own: adaptive samples
#define CLERESTORY_NUMBERED NUMBERED
#define CLERESTORY_SAMPLER SAMPLER_KIND

#include "techniques/path/camera_view.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    CameraView view;
    WalkKey key;
    uint slot_count;
} push;

#include "techniques/path/path_camera.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot < push.slot_count) {
        begin_path(slot, slot);
    }
}
