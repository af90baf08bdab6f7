#version 460
// How many kernels a leaf of the map should hold, from the sums of their areas; one workgroup. Twin of
// clerestory::accel::photon_map::leaf_threshold::automatic_leaf_size.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/map_tree.glsl"
#include "techniques/photon_mapping/photon_areas.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0, scalar) restrict readonly buffer PhotonAreas { uvec2 photon_areas[]; };
layout(set = 0, binding = 1, scalar) restrict buffer MapStateBlock { MapTreeState map_state; };
// What the host is told.
layout(set = 0, binding = 2, scalar) restrict writeonly buffer PhotonCover {
    uint area[2];  // of all kernels, a number of 64 bits, m2
    uint leaf_size;
} photon_cover;

// Numbers of 64 bits.
layout(push_constant, scalar) uniform PhotonLeafSizePush {
    uint groups;         // sums
    uint scene_area[2];  // m2
    uint share[2];       // of a point's kernels
    uint least;          // leaf size
} photon_push;

const double LEAF_SIZE_MAX = 4294967295.0lf;

void main() {
    uint lane = gl_LocalInvocationID.x;
    precise double areas = 0.0lf;
    for (uint group = lane; group < photon_push.groups; group += LBVH_GROUP_SIZE) {
        areas += packDouble2x32(photon_areas[group]);
    }
    double kernels = sum_of_group(lane, areas);
    if (lane == 0u) {
        precise double wanted = packDouble2x32(uvec2(photon_push.share[0], photon_push.share[1])) * kernels
                              / packDouble2x32(uvec2(photon_push.scene_area[0], photon_push.scene_area[1]));
        // Rounded half up; what is not finite, and what is not above the least, gives the least.
        bool is_more = wanted >= double(photon_push.least) + 0.5lf && !isinf(wanted);
        uint size = is_more ? uint(min(floor(wanted + 0.5lf), LEAF_SIZE_MAX)) : photon_push.least;
        map_state.leaf_size = size;
        uvec2 words = unpackDouble2x32(kernels);
        photon_cover.area[0] = words.x;
        photon_cover.area[1] = words.y;
        photon_cover.leaf_size = size;
    }
}
