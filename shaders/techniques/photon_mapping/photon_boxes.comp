#version 460
// First stage of a map: the boxes of the photons' kernels, the exact bounds of their doubled centres, and sums of the kernels' areas, each by a
// workgroup. Twin of clerestory::techniques::photon_mapping::map::box_and_area in the same arithmetic, to the bit where the device rounds products,
// sums and roots of 64 bits correctly, and to the nearest number of 32.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "techniques/photon_mapping/kernel.glsl"
#include "techniques/photon_mapping/photon_areas.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform utextureBuffer photon_records_in;
layout(set = 0, binding = 1, scalar) restrict writeonly buffer LbvhBoxes { ivec4 lbvh_boxes[]; };
layout(set = 0, binding = 2, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };
// Numbers of 64 bits.
layout(set = 0, binding = 3, scalar) restrict writeonly buffer PhotonAreas { uvec2 photon_areas[]; };

layout(push_constant, scalar) uniform PhotonBoxesPush { uint count; } photon_push;

shared int group_lower[3];
shared int group_upper[3];

// By how much boxes are larger than kernels, so that no rounding of the kernels' weights reaches beyond.
const double BOX_SLACK = 1.0e-6lf;
const double ROUNDING = 1.0lf / 8388608.0lf;
const double DOUBLE_PI = 3.14159265358979323846lf;

// As written, without contraction.
double dot_in_order(dvec3 a, dvec3 b) {
    precise double sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

// The box of a kernel, and the area of its ellipse over pi.
LbvhBox box_and_area(dvec3 centre, dvec3 along, dvec3 across, out double area) {
    area = dot_in_order(along, across);
    double across_squared = dot_in_order(across, across);
    precise double skew = sqrt(dot_in_order(along, along)) * sqrt(across_squared) / area;
    precise dvec3 squared = along * along + max(across_squared - across * across, dvec3(0.0lf));
    precise dvec3 extent = sqrt(squared);
    precise dvec3 half_sides = extent * (1.0lf + BOX_SLACK * skew) + abs(centre) * ROUNDING;
    precise dvec3 lower = centre - half_sides;
    precise dvec3 upper = centre + half_sides;
    return LbvhBox(ordered_integers(vec3(lower)), ordered_integers(vec3(upper)));
}

dvec3 vector_of(uvec4 quarter) { return dvec3(uintBitsToFloat(quarter.xyz)); }

void main() {
    uint lane = gl_LocalInvocationID.x;
    if (lane < 3u) {
        group_lower[lane] = 0x7FFFFFFF;
        group_upper[lane] = int(0x80000000u);
    }
    barrier();
    LbvhBox centres = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    precise double areas = 0.0lf;
    uint place = gl_WorkGroupID.x * LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION + lane;
    for (uint i = 0u; i < LBVH_BOXES_PER_INVOCATION && place < photon_push.count; ++i) {
        int at = int(PHOTON_QUARTERS * place);
        dvec3 centre = vector_of(texelFetch(photon_records_in, at));
        dvec3 across = vector_of(texelFetch(photon_records_in, at + 1));
        dvec3 along = vector_of(texelFetch(photon_records_in, at + 2));
        double area;
        LbvhBox box = box_and_area(centre, along, across, area);
        precise double on_surface = DOUBLE_PI * area;
        areas += on_surface;
        lbvh_boxes[LBVH_BOX_QUARTERS * place] = ivec4(box.lower, box.upper.x);
        lbvh_boxes[LBVH_BOX_QUARTERS * place + 1u] = ivec4(box.upper.yz, 0, 0);
        precise vec3 doubled = ordered_floats(box.lower) + ordered_floats(box.upper);
        ivec3 doubled_centre = ordered_integers(doubled);
        centres = lbvh_union(centres, LbvhBox(doubled_centre, doubled_centre));
        place += LBVH_GROUP_SIZE;
    }
    for (uint axis = 0u; axis < 3u; ++axis) {
        atomicMin(group_lower[axis], centres.lower[axis]);
        atomicMax(group_upper[axis], centres.upper[axis]);
    }
    double group_area = sum_of_group(lane, areas);
    if (lane < 3u) {
        atomicMin(lbvh_state.centres_lower[lane], group_lower[lane]);
        atomicMax(lbvh_state.centres_upper[lane], group_upper[lane]);
    }
    if (lane == 0u) {
        photon_areas[gl_WorkGroupID.x] = unpackDouble2x32(group_area);
    }
}
