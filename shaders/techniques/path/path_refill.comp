#version 460
// Waves that stay full: camera rays of consecutive samples of a wave, each in a slot that is free, at places behind those of the paths that are alive.
// path_camera.glsl says what they are.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SAMPLER_KIND = 0;  // SAMPLER_SOBOL, SAMPLER_PCG or SAMPLER_JOINT_SOBOL
layout(constant_id = 19) const bool HAS_MEDIA = true;
#define CLERESTORY_SAMPLER SAMPLER_KIND

#include "techniques/path/camera_view.glsl"
#include "walk/turnover.glsl"
#include "walk/wave.glsl"

layout(push_constant, scalar) uniform Push {
    CameraView view;
    WalkKey key;        // of the wave
    uint first_sample;  // in the wave
    uint sample_count;
    uint first_place;
    uint first_free;    // in the list of free slots
    uint first_result;
    uint round;         // that they begin in
} push;

layout(set = 2, binding = 0, scalar) restrict readonly buffer PathFree { uint path_free[]; };  // free slots
layout(set = 2, binding = 1, scalar) restrict writeonly buffer PathTurnover { uint path_turnover[]; };  // by slot: SLOT_*
// By slot: pixel, sample, the round that the path began in, and the place among results that it has.
layout(set = 2, binding = 2, scalar) restrict writeonly buffer PathNumbers { uvec4 path_numbers[]; };

#include "techniques/path/path_camera.glsl"

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.sample_count) {
        return;
    }
    uint slot = path_free[push.first_free + index];
    uint sample_slot = push.first_sample + index;
    begin_path(slot, sample_slot);
    if (HAS_MEDIA) {
        // What a path in the first bounce of a whole wave has.
        walk_medium_states[slot] = MediumState(vec3(1.0 / 3.0), 0.0);
    }
    path_turnover[slot] = SLOT_TAKEN;
    path_numbers[slot] = uvec4(walk_sequence(sample_slot), walk_index(sample_slot), push.round, push.first_result + index);
    walk_queue_out[push.first_place + index] = slot;
}
