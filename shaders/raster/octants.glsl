// Polygons cut along the planes x = 0, y = 0 and z = 0, so that each piece lies in one half or one octant. Sources and guarantees:
// raster/octants.rs, the twin.
#ifndef CLERESTORY_RASTER_OCTANTS_GLSL
#define CLERESTORY_RASTER_OCTANTS_GLSL

// Of a polygon: three, one more for each of three cuts; or four after one cut and four more where its outline crosses two planes.
const int OCTANT_CORNERS = 8;

struct OctantCorner {
    vec3 p;        // from the middle of the octants
    vec2 weights;  // of the triangle's corners 1 and 2
};

struct OctantPolygon {
    int count;
    OctantCorner corners[OCTANT_CORNERS];
};

// Octant of a point by bits, set for negative coordinates: zeros of both signs count as positive.
uint octant_of(vec3 p) {
    return (p.x < 0.0 ? 1u : 0u) | (p.y < 0.0 ? 2u : 0u) | (p.z < 0.0 ? 4u : 0u);
}

// Where the edge between two corners on different sides meets a plane: the same bits from either end, and no coordinate beyond the two
// ends'.
OctantCorner octant_crossing(OctantCorner one, OctantCorner other, int axis) {
    bool is_first = one.p[axis] >= 0.0;
    vec3 a = is_first ? one.p : other.p;
    vec3 b = is_first ? other.p : one.p;
    precise float span = a[axis] - b[axis];
    precise float t = span > 0.0 ? a[axis] / span : 0.0;
    precise vec3 p = a + t * (b - a);
    p = clamp(p, min(a, b), max(a, b));
    p[axis] = 0.0;
    vec2 from = is_first ? one.weights : other.weights;
    vec2 to = is_first ? other.weights : one.weights;
    return OctantCorner(p, from + t * (to - from));
}

// The part of a convex polygon with a coordinate of at least 0, or below it with the plane as its border.
OctantPolygon octant_half(OctantPolygon whole, int axis, bool is_below) {
    OctantPolygon part;
    part.count = 0;
    for (int i = 0; i < whole.count; ++i) {
        OctantCorner a = whole.corners[i];
        OctantCorner b = whole.corners[i + 1 < whole.count ? i + 1 : 0];
        bool a_is_below = a.p[axis] < 0.0;
        bool b_is_below = b.p[axis] < 0.0;
        if (a_is_below == is_below) {
            part.corners[part.count] = a;
            ++part.count;
        }
        // The upper part has corners on the plane already.
        if (a_is_below != b_is_below && (is_below || max(a.p[axis], b.p[axis]) > 0.0)) {
            part.corners[part.count] = octant_crossing(a, b, axis);
            ++part.count;
        }
    }
    return part;
}

// The same polygon with corners where its edges cross x = 0 and y = 0.
OctantPolygon octant_outline(OctantPolygon whole) {
    OctantPolygon outline;
    outline.count = 0;
    for (int i = 0; i < whole.count; ++i) {
        OctantCorner a = whole.corners[i];
        OctantCorner b = whole.corners[i + 1 < whole.count ? i + 1 : 0];
        outline.corners[outline.count] = a;
        ++outline.count;
        bvec2 crosses = notEqual(lessThan(a.p.xy, vec2(0.0)), lessThan(b.p.xy, vec2(0.0)));
        // Ends on a plane are corners of it already.
        crosses.x = crosses.x && a.p.x != 0.0 && b.p.x != 0.0;
        crosses.y = crosses.y && a.p.y != 0.0 && b.p.y != 0.0;
        bool is_x_first = abs(a.p.x) * abs(b.p.y - a.p.y) <= abs(a.p.y) * abs(b.p.x - a.p.x);
        for (int turn = 0; turn < 2; ++turn) {
            int axis = is_x_first == (turn == 0) ? 0 : 1;
            if (crosses[axis]) {
                outline.corners[outline.count] = octant_crossing(a, b, axis);
                ++outline.count;
            }
        }
    }
    return outline;
}

// Corner of a convex polygon that comes at a place of the triangle strip that covers it: from both ends in turn.
int octant_strip_corner(int place, int count) {
    int step = (place + 1) / 2;
    return place % 2 == 1 || place == 0 ? step : count - step;
}

#endif
