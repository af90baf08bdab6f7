// Camera rays of samples, and where their paths begin.
//
// Pixel filter: a box of one pixel. Thin lens of a disk aperture. Deterministic in (seed, pixel, sample). Expects: a push-constant block `push` with the
// CameraView `view` and the WalkKey `key`, whose sequences are pixels, places in them samples; and what walk/draws.glsl expects.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_CAMERA_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_CAMERA_GLSL

#include "techniques/path/path_slots.glsl"
#include "transport/warp.glsl"
#include "walk/draws.glsl"

layout(constant_id = 1) const bool HAS_LENS = true;
layout(constant_id = 2) const bool ORTHOGRAPHIC = false;
layout(constant_id = 3) const bool WRITE_AOVS = true;

// Slots of random numbers.
const uint DIMENSION_PIXEL = 0u;
const uint DIMENSION_LENS = 1u;

// Begins the path of a sample in a slot; `sample_slot` is what its random numbers are keyed by.
void begin_path(uint slot, uint sample_slot) {
    uint pixel = walk_sequence(sample_slot);
    Sampler s = walk_sampler(sample_slot, DIMENSION_PIXEL);
    vec2 position = vec2(float(pixel % push.view.width), float(pixel / push.view.width)) + sample_2d(s);
    vec2 plane = vec2(2.0 * position.x / float(push.view.width) - 1.0, 1.0 - 2.0 * position.y / float(push.view.height))
        * vec2(push.view.half_width, push.view.half_height);
    vec3 across = plane.x * push.view.right + plane.y * push.view.up;
    vec3 origin = ORTHOGRAPHIC ? push.view.origin + across : push.view.origin;
    vec3 direction = ORTHOGRAPHIC ? push.view.forward : push.view.forward + across;
    if (HAS_LENS) {
        s.dimension = DIMENSION_LENS;
        vec2 lens = push.view.lens_radius * square_to_disk(sample_2d(s));
        vec3 offset = lens.x * push.view.right + lens.y * push.view.up;
        origin += offset;
        direction = direction * push.view.focus_distance - offset;
    }
    walk_states_out[slot] = WalkState(origin, 1.0, normalize(direction), 0u, vec3(1.0), 0.0);
    walk_gathered[slot] = GatheredLight(vec3(0.0), push.view.interior);
    if (WRITE_AOVS) {
        path_aovs[slot].filled = 0u;
    }
}

#endif
