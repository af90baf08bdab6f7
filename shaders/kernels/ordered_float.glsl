// 32-bit floats as unsigned integers of the same order: exact for subnormals, and -0 comes before +0.
#ifndef CLERESTORY_KERNELS_ORDERED_FLOAT_GLSL
#define CLERESTORY_KERNELS_ORDERED_FLOAT_GLSL

const uint FLOAT_SIGN_BIT = 0x80000000u;
const uint FLOAT_INFINITY_BITS = 0x7F800000u;

uint ordered_float(uint bits) { return (bits & FLOAT_SIGN_BIT) != 0u ? ~bits : bits | FLOAT_SIGN_BIT; }

// Bits of the float again.
uint float_of_ordered(uint ordered) { return (ordered & FLOAT_SIGN_BIT) != 0u ? ordered ^ FLOAT_SIGN_BIT : ~ordered; }

bool nan_bits(uint bits) { return (bits & ~FLOAT_SIGN_BIT) > FLOAT_INFINITY_BITS; }

#endif
