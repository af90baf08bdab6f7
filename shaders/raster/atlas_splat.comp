#version 460
// The discs of surfels to the maps of many places: an invocation is for a point of a map. A map has a point of each stratum of the surfels, another one
// than other maps. The least distance of a texel stays, whatever the order.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = 64) in;

#include "accel/ray.glsl"
#include "invocation.glsl"
#include "maps/packed_direction.glsl"
#include "raster/splat_atlas.glsl"

layout(push_constant, scalar) uniform Push {
    AtlasLevel level;
    uint first_map;  // of the atlas
    uint maps;
    uint number;     // of the first map among all places
    uint points;     // of a map
    uint strata;     // surfels of a stratum
    float radius;    // of a disc
} push;

layout(set = 0, binding = 0, scalar) restrict readonly buffer OrientedSurfels { OrientedSurfel oriented_surfels[]; };
layout(set = 0, binding = 1, scalar) restrict readonly buffer MapOrigins { vec4 map_origins[]; };
layout(set = 0, binding = 2, scalar) restrict buffer AtlasTexels { uint atlas_texels[]; };

void main() {
    uint index = invocation_index();
    if (index >= push.maps * push.points) {
        return;
    }
    uint map = index / push.points;
    uint point = index % push.points;
    uint number = push.number + map;
    OrientedSurfel surfel = oriented_surfels[point * push.strata + atlas_stratum(number, point, push.strata)];
    vec3 p = surfel.position - map_origins[number].xyz;
    float distance = length(p);
    // What rays cannot reach has no place, and the origin no direction; comparisons are false for NaN.
    if (!(all(lessThanEqual(abs(p), vec3(MAX_COORDINATE))) && distance > 0.0)) {
        return;
    }
    vec3 normal = unpack_octahedral(surfel.normal, PACKED_NORMAL_BITS);
    int side = int(push.level.side);
    float half_diagonal = shadow_texel_radius(SHADOW_OCTAHEDRON, p, side);
    int reach = atlas_reach(distance, push.radius, half_diagonal);
    float slack = atlas_slack(surfel.position, distance);
    float middle_radius = atlas_middle_radius(distance, abs(dot(normal, p)), push.radius, half_diagonal);
    uint layer;
    ivec2 middle = min(ivec2(shadow_place(SHADOW_OCTAHEDRON, p, side, layer)), ivec2(side - 1));
    int across = 2 * reach + 1;
    int place = 0;
    do {
        ivec2 step_to = ivec2(place % across, place / across) - reach;
        ShadowTexel texel = shadow_wrap(SHADOW_OCTAHEDRON, ShadowTexel(0u, middle + step_to), side);
        vec3 direction = shadow_direction(SHADOW_OCTAHEDRON, texel, side);
        float found = atlas_distance(p, normal, step_to == ivec2(0) ? middle_radius : push.radius, slack, direction);
        uint bits = floatBitsToUint(found);
        if (bits < ATLAS_EMPTY) {
            atomicMin(atlas_texels[atlas_texel(push.level, push.first_map + map, texel.at)], bits);
        }
        ++place;
    } while (place < across * across);
}
