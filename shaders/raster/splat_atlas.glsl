// Surfels splatted as discs into octahedron maps of distances about many places at once. Sources and guarantees: raster/splat_atlas.rs.
#ifndef CLERESTORY_RASTER_SPLAT_ATLAS_GLSL
#define CLERESTORY_RASTER_SPLAT_ATLAS_GLSL

#include "raster/atlas_level.glsl"
#include "raster/omni_shadow.glsl"

// Distance of an empty texel, by its bits: infinity, which comes behind all others by bits as well.
const uint ATLAS_EMPTY = 0x7F800000u;

// Texels from its middle that a disc is drawn to, at most.
const int ATLAS_REACH = 3;

// Planes count as seen at so many half diagonals of a texel at least, radians: at its own angle.
const float ATLAS_LEAST_ANGLE = 2.0;

// A plane counts as one through the origin, which sees nothing of it, when it is no farther off than packed normals err over the distance of its point, and
// positions over their coordinates.
const float ATLAS_NORMAL_ERROR = 1.0 / 8192.0;
const float ATLAS_POSITION_ERROR = 1.0 / 2097152.0;

// Texels count as those of one surface when they are farther than the nearest by no more than this share.
const float ATLAS_SAME_SURFACE = 0.05;

// Multiplier, increment and output permutation of PCG with 32 bits of state.
const uint ATLAS_PCG_MULTIPLIER = 747796405u;
const uint ATLAS_PCG_INCREMENT = 2891336453u;
const uint ATLAS_PCG_PERMUTATION = 277803737u;

// A point of the surfaces, wherever they move.
struct SurfelPlace {
    uint triangle;
    vec2 weights;  // of its corners 1 and 2
};

// Where it is now.
struct OrientedSurfel {
    vec3 position;
    uint normal;  // pack_octahedral
};

uint atlas_hash(uint word) {
    uint state = word * ATLAS_PCG_MULTIPLIER + ATLAS_PCG_INCREMENT;
    uint mixed = ((state >> ((state >> 28u) + 4u)) ^ state) * ATLAS_PCG_PERMUTATION;
    return (mixed >> 22u) ^ mixed;
}

// Which surfel of its stratum is the so many-th point of a map.
uint atlas_stratum(uint map, uint point, uint strata) { return atlas_hash(atlas_hash(map) + point) % strata; }

// Texels from its middle that the disc of a surfel reaches, whose direction has texels of that half diagonal, in radians.
int atlas_reach(float distance, float radius, float half_diagonal) {
    float width = half_diagonal * sqrt(2.0);
    float texels = ceil(radius / (distance * width));
    // Not what is NaN.
    return texels < float(ATLAS_REACH) ? int(texels) : ATLAS_REACH;
}

// Radius of a disc in the texel of its middle, `height` of the origin over its plane: as large as the texel's half diagonal as the plane cuts it, up to half of
// its distance, so that the texel's centre finds a disc however small.
float atlas_middle_radius(float distance, float height, float radius, float half_diagonal) {
    float cosine = max(height / distance, ATLAS_LEAST_ANGLE * half_diagonal);
    return max(radius, distance * half_diagonal / cosine);
}

// Height over a plane up to which it counts as one through the origin.
float atlas_slack(vec3 position, float distance) {
    vec3 a = abs(position);
    return ATLAS_NORMAL_ERROR * distance + ATLAS_POSITION_ERROR * max(a.x, max(a.y, a.z));
}

// How far a unit direction goes to the disc about a point, which is given from where the direction begins, in its plane; infinite where it misses, and of planes that
// are no more than `slack` off.
float atlas_distance(vec3 p, vec3 normal, float radius, float slack, vec3 direction) {
    float height = dot(normal, p);
    float fall = height < 0.0 ? -dot(normal, direction) : dot(normal, direction);
    float nowhere = uintBitsToFloat(ATLAS_EMPTY);
    if (!(fall > 0.0 && abs(height) > slack)) {
        return nowhere;
    }
    float along = abs(height) / fall;
    vec3 beside = along * direction - p;
    return dot(beside, beside) <= radius * radius ? along : nowhere;
}

#endif
