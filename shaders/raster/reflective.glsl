// Reflective shadow maps: what texels of a light's view span, points of a sequence, and the step by which a point comes to texels as bright as they
// are. Sources and guarantees: raster/reflective.rs.
#ifndef CLERESTORY_RASTER_REFLECTIVE_GLSL
#define CLERESTORY_RASTER_REFLECTIVE_GLSL

// Below this the series of the arc tangent ends with its sixth power to rounding.
const float RSM_SMALL_TANGENT = 0.0625;
const float RSM_TURN = 6.28318530717958647692;
// The greatest number below 1.
const float RSM_BELOW_ONE = 1.0 - 1.0 / 16777216.0;
// Digits of a radical inverse in base 2.
const uint RSM_DIGITS = 32u;

// Of small arguments to rounding, where drivers' polynomials are off by 1e-5.
float rsm_arc_tangent(float t) {
    float s = t * t;
    return t < RSM_SMALL_TANGENT ? t * (1.0 - s * (1.0 / 3.0 - s * (1.0 / 5.0 - s / 7.0))) : atan(t);
}

// Solid angle of a triangle on the plane z = 1 of double area `twice`, whose corners are so far away, by van Oosterom and Strackee: nothing cancels, however small it is.
float rsm_triangle(vec3 a, vec3 b, vec3 c, float twice) {
    float la = length(a);
    float lb = length(b);
    float lc = length(c);
    return 2.0 * rsm_arc_tangent(twice / (la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb));
}

// Solid angle of a rectangle on the plane z = 1.
float rsm_solid_angle(vec2 lower, vec2 upper) {
    float area = (upper.x - lower.x) * (upper.y - lower.y);
    vec3 a = vec3(lower, 1.0);
    vec3 b = vec3(upper.x, lower.y, 1.0);
    vec3 c = vec3(upper, 1.0);
    vec3 d = vec3(lower.x, upper.y, 1.0);
    return rsm_triangle(a, b, c, area) + rsm_triangle(a, c, d, area);
}

// The digits of an index in a base, behind the point in reverse.
float rsm_radical_inverse(uint index, uint base) {
    float digit = 1.0 / float(base);
    float scale = digit;
    float sum = 0.0;
    uint count = 0u;
    do {
        sum += float(index % base) * scale;
        index /= base;
        scale *= digit;
        ++count;
    } while (index > 0u && count < RSM_DIGITS);
    return min(sum, RSM_BELOW_ONE);
}

// Where in a disc of that radius about the middle a point of the unit square comes: as many in each ring, however narrow.
vec2 rsm_disc_place(vec2 point, float radius) { return radius * point.x * vec2(sin(RSM_TURN * point.y), cos(RSM_TURN * point.y)); }

// Area that it stands for times the number of points: the inverse of its density; or, as published, by the square of its distance over the mean of that, which
// gives the right mean to what is the same everywhere in the disc.
float rsm_disc_weight(float distance, float radius, bool squared) {
    float disc = 0.5 * RSM_TURN * radius * radius;
    return disc * (squared ? 3.0 * distance * distance : 2.0 * distance);
}

// The child of four sums (left and right above, left and right below) that a point of the unit square falls in by their shares, which becomes its place within that
// child's. Children without anything are never chosen where there is another.
ivec2 rsm_warp(vec4 children, inout vec2 point) {
    vec2 rows = children.xz + children.yw;
    float above = rows.x / (rows.x + rows.y);
    bool is_below = point.y >= above;
    point.y = is_below ? (point.y - above) / (1.0 - above) : point.y / above;
    vec2 row = is_below ? children.zw : children.xy;
    float left = row.x / (row.x + row.y);
    bool is_right = point.x >= left;
    point.x = is_right ? (point.x - left) / (1.0 - left) : point.x / left;
    point = clamp(point, vec2(0.0), vec2(RSM_BELOW_ONE));
    return ivec2(is_right, is_below);
}

#endif
