// Choice among entries by tabulated cumulative probability.
//
// Method and layout: transport/distribution.rs. Guarantees: probabilities are exactly those with which the 2^24 values of a random
// number choose; entries of probability zero are never chosen; at most 24 steps.
// Expects: `float distribution_cdf(uint index)`, declared before the inclusion, which reads the tables.
#ifndef CLERESTORY_TRANSPORT_DISTRIBUTION_GLSL
#define CLERESTORY_TRANSPORT_DISTRIBUTION_GLSL

const int DISTRIBUTION_STEPS_MAX = 24;

// Probability of an entry of the table that begins at `base`.
float distribution_probability(uint base, uint entry) {
    return distribution_cdf(base + entry + 1u) - distribution_cdf(base + entry);
}

// The entry that u in [0, 1) chooses: the last one whose cumulative probability is at most u.
uint distribution_sample(uint base, uint count, float u, out float probability) {
    uint lower = 0u;
    uint upper = count;
    for (int step = 0; step < DISTRIBUTION_STEPS_MAX && upper - lower > 1u; ++step) {
        uint middle = (lower + upper) >> 1u;
        if (distribution_cdf(base + middle) <= u) {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    probability = distribution_probability(base, lower);
    return lower;
}

// Tables of a grid: the rows' (height + 1 values), then one (width + 1 values) for each row.
uint distribution_row_base(uint base, uvec2 size, uint row) { return base + size.y + 1u + row * (size.x + 1u); }

// The cell that u chooses.
uvec2 distribution_sample_2d(uint base, uvec2 size, vec2 u) {
    float p_row;
    float p_column;
    uint row = distribution_sample(base, size.y, u.y, p_row);
    uint column = distribution_sample(distribution_row_base(base, size, row), size.x, u.x, p_column);
    return uvec2(column, row);
}

#endif
