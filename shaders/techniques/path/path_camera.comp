#version 460
// Wavefront path tracer, first stage: camera rays of a wave of pixels × samples, one slot each (slot = pixel × samples + sample, so that the rays of a subgroup
// stay together).
//
// Pixel filter: a box of one pixel. Thin lens of a disk aperture. Deterministic in (seed, pixel, sample).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint SAMPLER_KIND = 0;  // SAMPLER_SOBOL, SAMPLER_PCG or SAMPLER_JOINT_SOBOL
layout(constant_id = 1) const bool HAS_LENS = true;
layout(constant_id = 2) const bool ORTHOGRAPHIC = false;
layout(constant_id = 3) const bool WRITE_AOVS = true;
layout(constant_id = 28) const bool NUMBERED = false;  // each slot has a pixel and sample of its own: pixels have differing numbers of samples
#define CLERESTORY_NUMBERED NUMBERED
#define CLERESTORY_SAMPLER SAMPLER_KIND

#include "techniques/path/path_slots.glsl"
#include "transport/warp.glsl"
#include "walk/wave.glsl"

// Slots of random numbers.
const uint DIMENSION_PIXEL = 0u;
const uint DIMENSION_LENS = 1u;

layout(push_constant, scalar) uniform Push {
    vec3 origin;
    float half_width;   // of the picture at distance 1, or in metres (orthographic)
    vec3 right;
    float half_height;
    vec3 up;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    uint width;
    uint height;
    uint slot_count;
    uint interior;      // material of the body that the camera is inside of, or OUTSIDE
    WalkKey key;        // sequences are pixels, places in them samples
} push;

#include "walk/draws.glsl"

void main() {
    uint slot = gl_GlobalInvocationID.x;
    if (slot >= push.slot_count) {
        return;
    }
    uint pixel = walk_sequence(slot);
    Sampler s = walk_sampler(slot, DIMENSION_PIXEL);
    vec2 position = vec2(float(pixel % push.width), float(pixel / push.width)) + sample_2d(s);
    vec2 plane = vec2(2.0 * position.x / float(push.width) - 1.0, 1.0 - 2.0 * position.y / float(push.height))
        * vec2(push.half_width, push.half_height);
    vec3 across = plane.x * push.right + plane.y * push.up;
    vec3 origin = ORTHOGRAPHIC ? push.origin + across : push.origin;
    vec3 direction = ORTHOGRAPHIC ? push.forward : push.forward + across;
    if (HAS_LENS) {
        s.dimension = DIMENSION_LENS;
        vec2 lens = push.lens_radius * square_to_disk(sample_2d(s));
        vec3 offset = lens.x * push.right + lens.y * push.up;
        origin += offset;
        direction = direction * push.focus_distance - offset;
    }
    walk_states_out[slot] = WalkState(origin, 0.0, normalize(direction), 0u, vec3(1.0), 1.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), push.interior);
    if (WRITE_AOVS) {
        path_aovs[slot].filled = 0u;
    }
}
