// Triangles divided into level² equal ones, by numbers alone. Twin: raster/tessellation.rs.
#ifndef CLERESTORY_RASTER_TESSELLATION_GLSL
#define CLERESTORY_RASTER_TESSELLATION_GLSL

// Weights of the whole triangle's corners at a corner of a piece, as whole numbers over the level. Pieces stand in rows from corner 0 on,
// and neighbours alternate.
uvec3 tessellation_weights(uint level, uint piece, uint corner) {
    uint row = uint(sqrt(float(piece)));
    // Square roots may be off by their last digit.
    row -= row * row > piece ? 1u : 0u;
    row += (row + 1u) * (row + 1u) <= piece ? 1u : 0u;
    uint along = piece - row * row;
    uint column = along / 2u;
    uvec2 at = along % 2u == 0u ? uvec2(row + min(corner, 1u), column + (corner == 2u ? 1u : 0u))
                                : uvec2(row + (corner == 1u ? 1u : 0u), column + min(corner, 1u));
    return uvec3(level - at.x, at.x - at.y, at.y);
}

// The same bits along an edge in both triangles that share it, in whichever order they have its ends.
vec3 tessellation_point(uvec3 weights, uint level, vec3 a, vec3 b, vec3 c) {
    precise vec3 sum = float(weights.x) * a + float(weights.y) * b + float(weights.z) * c;
    precise vec3 point = sum / float(level);
    return point;
}

#endif
