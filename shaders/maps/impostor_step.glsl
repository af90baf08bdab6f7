// Steps of searches for what a ray meets, and the planes of texels. Sources and guarantees: maps/impostor/mod.rs.
#ifndef CLERESTORY_MAPS_IMPOSTOR_STEP_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_STEP_GLSL

// A texel's distance goes on along its plane up to so many times it, and down to so small a part.
const float IMPOSTOR_PLANE_BOUND = 2.0;
// Difference of two ratios below which no line goes through them.
const float IMPOSTOR_FLAT = 1e-6;

// Of a texel's distance at its centre, along its plane; by the cosines of both directions with its normal.
float impostor_plane(float distance, float at_centre, float at_direction) {
    return at_centre * at_direction > 0.0
               ? distance * clamp(at_centre / at_direction, 1.0 / IMPOSTOR_PLANE_BOUND, IMPOSTOR_PLANE_BOUND)
               : distance;
}

// From a guess (d, g) by the line through it and another one, or, without, through the point at infinity.
float impostor_step(vec2 guess, bool has_other, vec2 other, float far) {
    if (!has_other) {
        return far * (1.0 - guess.y);
    }
    float slope = guess.y - other.y;
    return abs(slope) < IMPOSTOR_FLAT ? 0.0 : (guess.x - other.x) * (1.0 - guess.y) / slope;
}

#endif
