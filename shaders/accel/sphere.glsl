// Closest approach of a ray to a point and ray/sphere intersection; twin of clerestory::accel::sphere. Directions have unit length.
#ifndef CLERESTORY_ACCEL_SPHERE_GLSL
#define CLERESTORY_ACCEL_SPHERE_GLSL

// Ray parameter and squared distance of the closest approach; projected, not |δ|² − t², which cancels.
vec2 closest_approach(vec3 origin, vec3 direction, vec3 centre) {
    vec3 delta = centre - origin;
    float t = dot(delta, direction);
    vec3 rest = delta - t * direction;
    return vec2(t, dot(rest, rest));
}

bool intersect_sphere(vec3 origin, vec3 direction, vec3 centre, float radius, out vec2 t) {
    vec2 approach = closest_approach(origin, direction, centre);
    float dist = sqrt(approach.y);
    float chord_squared = (radius - dist) * (radius + dist);
    bool hit = radius > 0.0 && chord_squared >= 0.0;
    float half_chord = sqrt(hit ? chord_squared : 0.0);
    t = approach.x + vec2(-half_chord, half_chord);
    return hit;
}

#endif
