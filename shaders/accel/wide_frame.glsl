// The grid of a wide node and its boxes on it, as they are written; twin of clerestory::accel::wide's frame and grid, which compute in f64.
//
// Everything is exact in f32, also where numbers below the smallest normal one are flushed to zero: what is scaled by a power of two is at least a
// step large, and what is smaller counts by its sign. The includer declares, before this file, what is written to:
//   uvec4 wide_texels[];
#ifndef CLERESTORY_ACCEL_WIDE_FRAME_GLSL
#define CLERESTORY_ACCEL_WIDE_FRAME_GLSL

#include "accel/lbvh.glsl"
#include "accel/wide_layout.glsl"

const int WIDE_EXPONENT_BIAS = 127;
// Of a step, as on the host.
const int WIDE_LEAST_EXPONENT = -80;
const float WIDE_LAST_PLANE = 255.0;
// The exponent of an extent, less this, is below that of its finest step, however the extent was rounded; and the steps that are tried from there on
// until the grid reaches are fewer than the second.
const int WIDE_FINEST_BELOW_EXTENT = 10;
const uint WIDE_MOST_DOUBLINGS = 16u;

struct WideAxis {
    // The corner, in steps.
    float first;
    int exponent;
};

int wide_exponent(float x) {
    return int(floatBitsToUint(x) >> WIDE_EXPONENT_SHIFT & 0xFFu) - WIDE_EXPONENT_BIAS;
}

float wide_power(int exponent) { return uintBitsToFloat(uint(exponent + WIDE_EXPONENT_BIAS) << WIDE_EXPONENT_SHIFT); }

// The last multiple of a step that is not above a number, in steps. The number is no negative zero.
float wide_floor(float x, int exponent) {
    float whole = floor(x * wide_power(-exponent));
    // By integers, since a choice between -1 and 0 may become a negative zero, whose bits a corner would keep.
    float of_small = float(floatBitsToInt(x) >> 31);
    return wide_exponent(x) < exponent ? of_small : whole;
}

// The first that is not below it.
float wide_ceil(float x, int exponent) {
    float whole = ceil(x * wide_power(-exponent));
    float of_small = float(clamp(floatBitsToInt(x), 0, 1));
    return wide_exponent(x) < exponent ? of_small : whole;
}

// The finest grid from `lower` to `upper`.
WideAxis wide_axis(float lower, float upper) {
    int exponent = max(wide_exponent(upper - lower) - WIDE_FINEST_BELOW_EXTENT, WIDE_LEAST_EXPONENT);
    float first = wide_floor(lower, exponent);
    float last = wide_ceil(upper, exponent);
    for (uint i = 0u; last - first > WIDE_LAST_PLANE && i < WIDE_MOST_DOUBLINGS; ++i) {
        ++exponent;
        first = wide_floor(lower, exponent);
        last = wide_ceil(upper, exponent);
    }
    return WideAxis(first, exponent);
}

// Writes corner, steps and planes of the node at a texel: `all` is the box of it, and the other boxes are those of the slots that are occupied, a
// bit each.
void wide_set_boxes(uint texel, LbvhBox all, uint occupied, LbvhBox boxes[WIDE_SLOTS]) {
    vec3 lower = ordered_floats(all.lower);
    vec3 upper = ordered_floats(all.upper);
    vec3 corner = vec3(0.0);
    uint exponents = 0u;
    for (uint axis = 0u; axis < 3u; ++axis) {
        WideAxis grid = wide_axis(lower[axis], upper[axis]);
        corner[axis] = grid.first * wide_power(grid.exponent);
        exponents |= uint(grid.exponent + WIDE_EXPONENT_BIAS) << 8u * axis;
        uvec4 planes = uvec4(0u);
        for (uint slot = 0u; slot < WIDE_SLOTS; ++slot) {
            bool has = (occupied >> slot & 1u) != 0u;
            vec3 slot_lower = has ? ordered_floats(boxes[slot].lower) : lower;
            vec3 slot_upper = has ? ordered_floats(boxes[slot].upper) : upper;
            uint low = uint(wide_floor(slot_lower[axis], grid.exponent) - grid.first);
            uint high = uint(wide_ceil(slot_upper[axis], grid.exponent) - grid.first);
            uint at = 8u * (slot & 3u);
            planes[slot >> 2] |= has ? low << at : 0u;
            planes[2u + (slot >> 2)] |= has ? high << at : 0u;
        }
        wide_texels[texel + 2u + axis] = planes;
    }
    wide_texels[texel] = uvec4(floatBitsToUint(corner), exponents);
}

#endif
