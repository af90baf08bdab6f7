// The logarithm of 1 - x and its inverse for small x, with all digits: for narrow lobes, whose powers of a cosine come from what that lacks to 1.
#ifndef CLERESTORY_TRANSPORT_BELOW_ONE_GLSL
#define CLERESTORY_TRANSPORT_BELOW_ONE_GLSL

// Below it series are exact to the last digits.
const float BELOW_ONE_SERIES_MAX = 0.25;

// ln(1 - x) for x in [0, 1), exact near 0: twice the series of the inverse hyperbolic tangent.
float log_below_one(float x) {
    float y = x / (2.0 - x);
    float s = y * y;
    return x < BELOW_ONE_SERIES_MAX ? -2.0 * y * (1.0 + s * (1.0 / 3.0 + s * (0.2 + s * (1.0 / 7.0)))) : log(1.0 - x);
}

// 1 - exp(-x) for x >= 0, exact near 0.
float exp_below_one(float x) {
    float series = x * (1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0)))));
    return x < BELOW_ONE_SERIES_MAX ? series : 1.0 - exp(-x);
}

#endif
