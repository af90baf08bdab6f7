// Steps of searches for what a ray meets, and the planes of texels. Sources and guarantees: maps/impostor/mod.rs.
#ifndef CLERESTORY_MAPS_IMPOSTOR_STEP_GLSL
#define CLERESTORY_MAPS_IMPOSTOR_STEP_GLSL

// A texel's distance goes on along its plane up to so many times it, and down to so small a part.
const float IMPOSTOR_PLANE_BOUND = 2.0;
// Difference of two ratios below which no line goes through them.
const float IMPOSTOR_FLAT = 1e-6;

// A texel's plane, of the points y with dot(plane.xyz, y) = 1, and one over the distance at the texel's centre, which is given and lies in the unit direction c; of
// a normal of any length, to either side. A plane that is seen from aside, along it, is none: 0.
vec4 impostor_plane(float inverse, vec3 n, vec3 c) {
    float at_centre = dot(n, c);
    return vec4(at_centre != 0.0 ? (inverse / at_centre) * n : vec3(0.0), inverse);
}

// The length `size` of l over the distance of a texel's plane in the direction of l: below 1 in front of it. No more than a bound from that over the distance at the
// centre, since a plane seen from aside has any distance within a texel; where the plane does not lie that way, just that.
float impostor_plane_ratio(vec4 plane, vec3 l, float size) {
    float at_centre = plane.w * size;
    float along = dot(plane.xyz, l);
    return along > 0.0 ? clamp(along, (1.0 / IMPOSTOR_PLANE_BOUND) * at_centre, IMPOSTOR_PLANE_BOUND * at_centre) : at_centre;
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
