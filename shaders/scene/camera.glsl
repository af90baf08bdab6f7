// Rays of a camera, for kernels that begin at the eye. Twin of clerestory::scene::camera_frame.
#ifndef CLERESTORY_SCENE_CAMERA_GLSL
#define CLERESTORY_SCENE_CAMERA_GLSL

// An orthonormal frame with what maps pixels, lens and distance.
struct CameraRays {
    vec3 origin;
    float half_width;      // of the picture at distance 1, or in metres (orthographic)
    vec3 right;
    float half_height;
    vec3 up;
    float lens_radius;
    vec3 forward;
    float focus_distance;
    uint width;            // of the picture, pixels
    uint height;
    uint is_parallel;
};

// The ray through a place of the picture, in pixels from its upper left corner, from a point of the unit disk as the lens.
void camera_ray(CameraRays c, vec2 place, vec2 lens, out vec3 origin, out vec3 direction) {
    vec2 plane = vec2(2.0 * place.x / float(c.width) - 1.0, 1.0 - 2.0 * place.y / float(c.height)) * vec2(c.half_width, c.half_height);
    vec3 across = plane.x * c.right + plane.y * c.up;
    if (c.is_parallel != 0u) {
        origin = c.origin + across;
        direction = c.forward;
        return;
    }
    vec3 offset = c.lens_radius * (lens.x * c.right + lens.y * c.up);
    origin = c.origin + offset;
    direction = normalize(c.lens_radius > 0.0 ? (c.forward + across) * c.focus_distance - offset : c.forward + across);
}

#endif
