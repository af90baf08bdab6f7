#version 460
// First stage of a volume map: the boxes of events' kernels and of planes, and the exact bounds of their doubled centres. Twin of
// clerestory::techniques::photon_mapping::volume::event::event_box, to the bit.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "techniques/photon_mapping/photon_event.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(set = 0, binding = 0) uniform utextureBuffer event_records_in;
layout(set = 0, binding = 1, scalar) restrict writeonly buffer LbvhBoxes { ivec4 lbvh_boxes[]; };
layout(set = 0, binding = 2, scalar) restrict buffer LbvhStateBlock { LbvhState lbvh_state; };

layout(constant_id = 0) const bool BEAMS = false;  // records are pieces of ways
layout(constant_id = 1) const bool PLANES = false;  // or planes, too
layout(constant_id = 2) const bool POINTS = false;  // or collisions
const bool WIDE = PLANES || POINTS;

layout(push_constant, scalar) uniform PhotonEventBoxesPush {
    uint count;
    float radius;  // of beams, m
} event_push;

shared int group_lower[3];
shared int group_upper[3];

// The box of a kernel about a place, or about what lies between two.
LbvhBox event_box(vec3 a, vec3 b, float radius) {
    precise float wide = radius + EVENT_SLACK * radius;
    precise vec3 rounding = EVENT_ROUNDING * max(abs(a), abs(b));
    precise vec3 beyond = wide + rounding;
    precise vec3 lower = min(a, b) - beyond;
    precise vec3 upper = max(a, b) + beyond;
    return LbvhBox(ordered_integers(lower), ordered_integers(upper));
}

// From the ends of its first flight those of a plane's box.
void plane_corners(vec3 second, inout vec3 a, inout vec3 b) {
    precise vec3 c = a + second;
    precise vec3 d = b + second;
    vec3 lower = min(min(a, b), min(c, d));
    b = max(max(a, b), max(c, d));
    a = lower;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    if (lane < 3u) {
        group_lower[lane] = 0x7FFFFFFF;
        group_upper[lane] = int(0x80000000u);
    }
    barrier();
    uint place = gl_WorkGroupID.x * LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION + lane;
    LbvhBox centres = LbvhBox(ivec3(0x7FFFFFFF), ivec3(int(0x80000000u)));
    for (uint i = 0u; i < LBVH_BOXES_PER_INVOCATION && place < event_push.count; ++i) {
        uint quarter = (WIDE ? WIDE_QUARTERS : EVENT_QUARTERS) * place;
        vec3 from = uintBitsToFloat(texelFetch(event_records_in, int(quarter)).xyz);
        uvec4 q1 = texelFetch(event_records_in, int(quarter + 1u));
        vec3 to = BEAMS ? uintBitsToFloat(q1.xyz) : from;
        float radius = BEAMS ? event_push.radius : uintBitsToFloat(q1.y);
        uvec4 q2 = uvec4(0u);
        if (WIDE) {
            q2 = texelFetch(event_records_in, int(quarter + 2u));
        }
        if (PLANES && is_plane(q2)) {
            plane_corners(uintBitsToFloat(q2.xyz), from, to);
            radius = 0.0;
        }
        if (POINTS && is_point(q2)) {
            to = from;
            radius = uintBitsToFloat(q1.y);
        }
        LbvhBox box = event_box(from, to, radius);
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
    barrier();
    if (lane < 3u) {
        atomicMin(lbvh_state.centres_lower[lane], group_lower[lane]);
        atomicMax(lbvh_state.centres_upper[lane], group_upper[lane]);
    }
}
