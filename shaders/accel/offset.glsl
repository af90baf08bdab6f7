// Ray starts that neither meet their own surface again nor skip another close by; twin of clerestory::accel::offset, which proves it.
#ifndef CLERESTORY_ACCEL_OFFSET_GLSL
#define CLERESTORY_ACCEL_OFFSET_GLSL

struct SurfacePoint {
    vec3 position;
    vec3 error;
};

const float SURFACE_SLACK = 1.0 / 131072.0;
const float POSITION_ROUNDING = 3.0 / 16777216.0;
const float EDGE_ROUNDING = 6.0 / 16777216.0;

float scene_reach(vec3 point, vec3 lower, vec3 upper) {
    vec3 reach = max(abs(lower - point), abs(upper - point));
    return max(reach.x, max(reach.y, reach.z));
}

SurfacePoint surface_point(vec3 v0, vec3 v1, vec3 v2, vec2 barycentrics, float reach) {
    vec3 along1 = (v1 - v0) * barycentrics.x;
    vec3 along2 = (v2 - v0) * barycentrics.y;
    vec3 position = v0 + (along1 + along2);
    vec3 error = POSITION_ROUNDING * abs(position) + EDGE_ROUNDING * (abs(along1) + abs(along2)) + SURFACE_SLACK * reach;
    return SurfacePoint(position, error);
}

vec3 offset_ray_origin(vec3 position, vec3 error, vec3 geometric_normal, vec3 direction) {
    float offset = dot(abs(geometric_normal), error);
    return position + geometric_normal * (dot(geometric_normal, direction) < 0.0 ? -offset : offset);
}

// Start and direction of a shadow segment, t in [0, 1]; a zero normal leaves that end where it is (point lights).
void shadow_segment(SurfacePoint from, vec3 from_normal, SurfacePoint to, vec3 to_normal, out vec3 start, out vec3 segment) {
    vec3 direction = to.position - from.position;
    start = offset_ray_origin(from.position, from.error, from_normal, direction);
    segment = offset_ray_origin(to.position, to.error, to_normal, -direction) - start;
}

#endif
