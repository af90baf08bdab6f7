// Bins of a histogram of potential contributions: exact sums in bins of a quarter of an octave tell which lights carry a share of the sum, in place of a sort.
// Twin of instant_radiosity/selection/bins.rs.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_POTENTIAL_BINS_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_POTENTIAL_BINS_GLSL

// Bins, and what of the bits of a potential's luminance, W/(m2 sr), numbers them: the exponent and two bits behind it, from 2^-40 on. What lies below or beyond
// is in the outermost bins.
const uint POTENTIAL_BINS = 256u;
const uint POTENTIAL_BIN_SHIFT = 21u;
const uint POTENTIAL_FIRST_BIN = 348u;

uint potential_bin(float key) {
    uint bits = floatBitsToUint(key) >> POTENTIAL_BIN_SHIFT;
    return clamp(bits, POTENTIAL_FIRST_BIN, POTENTIAL_FIRST_BIN + POTENTIAL_BINS - 1u) - POTENTIAL_FIRST_BIN;
}

// The least key of a bin: zero of the first.
float potential_bin_least(uint bin) { return bin == 0u ? 0.0 : uintBitsToFloat((bin + POTENTIAL_FIRST_BIN) << POTENTIAL_BIN_SHIFT); }

#endif
