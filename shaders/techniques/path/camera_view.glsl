// What a camera sees, and from where.
#ifndef CLERESTORY_TECHNIQUES_PATH_CAMERA_VIEW_GLSL
#define CLERESTORY_TECHNIQUES_PATH_CAMERA_VIEW_GLSL

struct CameraView {
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
    uint interior;      // material of the body that the camera is inside of, or OUTSIDE
};

#endif
