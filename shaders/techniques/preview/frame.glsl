// What a part of a picture is shaded by.
#ifndef CLERESTORY_TECHNIQUES_PREVIEW_FRAME_GLSL
#define CLERESTORY_TECHNIQUES_PREVIEW_FRAME_GLSL

#include "techniques/preview/probe.glsl"

// Lights without a shadow map have this one.
const uint PREVIEW_NO_SHADOW = 0xFFFFFFFFu;

struct PreviewFrame {
    vec3 origin;
    uint width;
    vec3 right;  // over the picture's half width
    uint height;
    vec3 down;   // over its half height
    uint is_parallel;
    vec3 forward;
    uint light_count;
    vec3 lower;  // corner of the scene
    uint first_triangle;  // of those that are shaded
    vec3 upper;
    uint end_triangle;
    uint first_pixel;  // where the radiance of the first pixel goes
    uint stride;       // from row to row
    uint has_background;
    int shadow_side;
    uint probe_levels;
    float probe_alphas[PROBE_LEVELS_MAX];
};

#endif
