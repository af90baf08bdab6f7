// Sums in pairs of 32-bit floats that do not stall: hi + lo carries about 48 bits.
//
// Twin of film/accumulate.rs, function by function. Sources: two_sum, Knuth, The Art of Computer Programming vol. 2, 4.2.2, theorem B;
// quick_two_sum, split and two_product, Dekker 1971, sections 3 and 5 (the splitting is Veltkamp's).
// All results are `precise`: a compiler that reassociated them would drop the error terms. two_product splits its factors because
// fma() may round twice (GLSL 4.60, 8.3), which would make its error term wrong.
// Where a device flushes subnormals, error terms below 2^-126 are lost, an absolute error of less than 2^-126 an operation.
#ifndef CLERESTORY_FILM_TWO_FLOAT_GLSL
#define CLERESTORY_FILM_TWO_FLOAT_GLSL

// The unevaluated sum hi + lo with |lo| <= ulp(hi) / 2.
struct TwoFloat {
    float hi;
    float lo;
};

// Veltkamp's constant 2^12 + 1 for a 24-bit significand.
const float TWO_FLOAT_SPLITTER = 4097.0;

// a + b = hi + lo exactly.
TwoFloat two_sum(float a, float b) {
    precise float sum = a + b;
    precise float b_virtual = sum - a;
    precise float a_virtual = sum - b_virtual;
    precise float b_error = b - b_virtual;
    precise float a_error = a - a_virtual;
    precise float error = a_error + b_error;
    return TwoFloat(sum, error);
}

// a + b = hi + lo exactly, for |a| >= |b| or a = 0.
TwoFloat quick_two_sum(float a, float b) {
    precise float sum = a + b;
    precise float b_virtual = sum - a;
    precise float error = b - b_virtual;
    return TwoFloat(sum, error);
}

// a = hi + lo exactly, each with at most 12 significant bits, for |a| < 2^115.
TwoFloat split(float a) {
    precise float scaled = TWO_FLOAT_SPLITTER * a;
    precise float excess = scaled - a;
    precise float hi = scaled - excess;
    precise float lo = a - hi;
    return TwoFloat(hi, lo);
}

// a * b = hi + lo exactly, unless the product overflows or the error term is subnormal.
TwoFloat two_product(float a, float b) {
    precise float product = a * b;
    TwoFloat x = split(a);
    TwoFloat y = split(b);
    precise float high = x.hi * y.hi;
    precise float outer = x.hi * y.lo;
    precise float inner = x.lo * y.hi;
    precise float low = x.lo * y.lo;
    precise float rest = high - product;
    rest = rest + outer;
    rest = rest + inner;
    precise float error = rest + low;
    return TwoFloat(product, error);
}

// a + b with a relative error of at most 2^-46 of |a| + |b|.
TwoFloat two_float_add(TwoFloat a, float b) {
    TwoFloat sum = two_sum(a.hi, b);
    precise float lo = a.lo + sum.lo;
    return quick_two_sum(sum.hi, lo);
}

// a + b with a relative error of at most 2^-44 of |a| + |b|.
TwoFloat two_float_add_two_float(TwoFloat a, TwoFloat b) {
    TwoFloat sum = two_sum(a.hi, b.hi);
    precise float tails = a.lo + b.lo;
    precise float lo = tails + sum.lo;
    return quick_two_sum(sum.hi, lo);
}

// a + x * x, the square taken exactly.
TwoFloat two_float_add_square(TwoFloat a, float x) {
    return two_float_add_two_float(a, two_product(x, x));
}

#endif
