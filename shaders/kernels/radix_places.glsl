// Places of digits in the radix sorts of one workgroup. A file that includes this includes `radix_digit.glsl` before.
#ifndef CLERESTORY_KERNELS_RADIX_PLACES_GLSL
#define CLERESTORY_KERNELS_RADIX_PLACES_GLSL

#include "kernels/wrapping_sum.glsl"

// By digit, then invocation: how many there are; after the scan, the place of the next.
shared uint places[BINS * LANES];

uint place_slot(uint digit) { return digit * LANES + gl_LocalInvocationID.x; }

// Counts become the places of the first of each digit and invocation.
void scan_places() {
    uint first = gl_LocalInvocationID.x * BINS;
    uint own = 0u;
    for (uint i = first; i < first + BINS; ++i) {
        own += places[i];
    }
    uint total;
    uint before = team_exclusive(own, total);
    for (uint i = first; i < first + BINS; ++i) {
        uint count = places[i];
        places[i] = before;
        before += count;
    }
}

#endif
