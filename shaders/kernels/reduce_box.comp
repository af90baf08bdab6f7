#version 460
// The bounding box of points or of boxes, exact; NaN coordinates are left out, and nothing at all gives the empty box (infinity, -infinity).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/reduce.glsl"
#include "kernels/ordered_float.glsl"

// Words of an element: 3 of a point, 6 of a box (lower corner, upper corner), or more where something follows.
layout(constant_id = 4) const uint STRIDE = 3u;
// Word of the upper corner in an element; 0 for points.
layout(constant_id = 5) const uint UPPER = 0u;

layout(push_constant, scalar) uniform Push { StreamPlan plan; } push;
layout(set = 0, binding = 1, scalar) restrict readonly buffer ReduceElements { uint reduce_elements[]; };
layout(set = 0, binding = 2, scalar) restrict writeonly buffer ReduceBox { uint reduce_box[6]; };

struct OrderedBox {
    uvec3 lower;
    uvec3 upper;
};

OrderedBox empty_box() {
    return OrderedBox(uvec3(ordered_float(FLOAT_INFINITY_BITS)), uvec3(ordered_float(FLOAT_INFINITY_BITS | FLOAT_SIGN_BIT)));
}

OrderedBox join_boxes(OrderedBox a, OrderedBox b) { return OrderedBox(min(a.lower, b.lower), max(a.upper, b.upper)); }

#define TEAM_TYPE OrderedBox
#define TEAM_IDENTITY empty_box()
#define TEAM_COMBINE(earlier, later) join_boxes(earlier, later)
#include "kernels/team_scan.glsl"

uint box_at(uint team) { return 6u * team; }

void main() {
    uvec3 range = reduce_range(push.plan);
    OrderedBox part = empty_box();
    for (uint at = range.x; at < range.y; at += range.z) {
        for (uint axis = 0u; axis < 3u; ++axis) {
            if (LAST) {
                part.lower[axis] = min(part.lower[axis], scratch[box_at(at) + axis]);
                part.upper[axis] = max(part.upper[axis], scratch[box_at(at) + 3u + axis]);
            } else {
                uint lower = reduce_elements[STRIDE * at + axis];
                uint upper = reduce_elements[STRIDE * at + UPPER + axis];
                if (!nan_bits(lower)) {
                    part.lower[axis] = min(part.lower[axis], ordered_float(lower));
                }
                if (!nan_bits(upper)) {
                    part.upper[axis] = max(part.upper[axis], ordered_float(upper));
                }
            }
        }
    }
    OrderedBox total = part;
    if (!SERIAL || LAST) {
        team_exclusive(part, total);
    }
    if (reduce_lane() != 0u || reduce_team() >= push.plan.max_teams) {
        return;
    }
    for (uint axis = 0u; axis < 3u; ++axis) {
        if (LAST) {
            reduce_box[axis] = float_of_ordered(total.lower[axis]);
            reduce_box[3u + axis] = float_of_ordered(total.upper[axis]);
        } else {
            scratch[box_at(reduce_team()) + axis] = total.lower[axis];
            scratch[box_at(reduce_team()) + 3u + axis] = total.upper[axis];
        }
    }
}
