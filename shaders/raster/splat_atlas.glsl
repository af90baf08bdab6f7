// Surfels splatted as discs into octahedron maps of distances about many places at once. Sources and guarantees: raster/splat_atlas.rs.
#ifndef CLERESTORY_RASTER_SPLAT_ATLAS_GLSL
#define CLERESTORY_RASTER_SPLAT_ATLAS_GLSL

#include "raster/atlas_level.glsl"
#include "raster/omni_shadow.glsl"

// Distance of an empty texel, by its bits: infinity, which comes behind all others by bits as well.
const uint ATLAS_EMPTY = 0x7F800000u;

// Texels from its middle that a disc is drawn to, at most.
const int ATLAS_REACH = 3;

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

// How far a unit direction goes to the disc about a point, which is given from where the direction begins, in its plane; infinite where it misses. The middle
// texel has the disc whole, however small it is: there the plane counts as far as `spread` from the point.
float atlas_distance(vec3 p, vec3 normal, float radius, float spread, vec3 direction, bool is_middle) {
    float height = dot(normal, p);
    float fall = dot(normal, direction);
    bool is_turned = height < 0.0;
    height = is_turned ? -height : height;
    fall = is_turned ? -fall : fall;
    float nowhere = uintBitsToFloat(ATLAS_EMPTY);
    if (!(fall > 0.0)) {
        return nowhere;
    }
    float along = height / fall;
    vec3 beside = along * direction - p;
    if (is_middle) {
        float middle = length(p);
        return clamp(along, max(middle - spread, 0.0), middle + spread);
    }
    return dot(beside, beside) <= radius * radius ? along : nowhere;
}

#endif
