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

// The level of detail of a look-up for a lobe of width alpha, between the levels' own widths.
float probe_level(PreviewFrame frame, float alpha) {
    uint level = 0u;
    while (level + 2u < frame.probe_levels && alpha >= frame.probe_alphas[level + 1u]) {
        ++level;
    }
    float part = frame.probe_levels > 1u ? probe_part(alpha, frame.probe_alphas[level], frame.probe_alphas[level + 1u]) : 0.0;
    return float(level) + part;
}

#endif
