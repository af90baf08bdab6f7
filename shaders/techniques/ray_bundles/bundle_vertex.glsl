// Where the eye path of a pixel is, between the kernels that lead it on: on a surface, and how it came there or is to leave.
#ifndef CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_VERTEX_GLSL
#define CLERESTORY_TECHNIQUES_RAY_BUNDLES_BUNDLE_VERTEX_GLSL

// What is done where paths are.
const uint BUNDLE_SHOWS_EMITTED = 1u;
const uint BUNDLE_SHOWS_DIRECT = 2u;
const uint BUNDLE_GOES_ON = 4u;

struct BundleVertex {
    vec3 direction;     // of the way to here; once light here was found, of the way from here
    uint triangle;      // NO_HIT where the path has ended
    vec3 throughput;    // of what comes from here to the eye
    vec2 barycentrics;
};

#endif
