// Choice among entries by tabulated cumulative probability.
//
// Method and layout: transport/distribution.rs. Guarantees: probabilities are exactly those with which the upper 24 bits of a random
// word choose; entries of probability zero are never chosen; at most 24 steps.
// Expects: `float distribution_cdf(uint index)`, declared before the inclusion, which reads the tables; what random.glsl expects.
#ifndef CLERESTORY_TRANSPORT_DISTRIBUTION_GLSL
#define CLERESTORY_TRANSPORT_DISTRIBUTION_GLSL

#include "transport/choice.glsl"
#include "transport/random.glsl"

const int DISTRIBUTION_STEPS_MAX = 24;
const float DISTRIBUTION_QUANTA = 16777216.0;
const float WORD_RANGE = 4294967296.0;

// Probability of an entry of the table that begins at `base`.
float distribution_probability(uint base, uint entry) {
    return distribution_cdf(base + entry + 1u) - distribution_cdf(base + entry);
}

// The place of a word within the share of all words that begins at `first`, as a word again. The bits that choosing took are made up for
// by those of `fresh`, so that it has 24 good bits however small the share; rounding moves it by half of the last of them at most.
uint rescaled_word(uint word, float first, float share, uint fresh) {
    uint rest = word - (uint(first * DISTRIBUTION_QUANTA) << 8u);
    float place = (float(rest) + unit_float(fresh)) / (share * WORD_RANGE);
    return uint(min(place, BELOW_ONE) * DISTRIBUTION_QUANTA) << 8u | fresh & 255u;
}

// The entry that a word chooses: the last one whose cumulative probability is at most the word's upper 24 bits. The word becomes
// its place within that entry's share.
uint distribution_sample(uint base, uint count, inout uint word, uint fresh, out float probability) {
    float u = unit_float(word);
    uint lower = 0u;
    uint upper = count;
    float first = 0.0;
    float end = 1.0;
    for (int step = 0; step < DISTRIBUTION_STEPS_MAX && upper - lower > 1u; ++step) {
        uint middle = (lower + upper) >> 1u;
        float cumulative = distribution_cdf(base + middle);
        if (cumulative <= u) {
            lower = middle;
            first = cumulative;
        } else {
            upper = middle;
            end = cumulative;
        }
    }
    probability = end - first;
    word = rescaled_word(word, first, probability, fresh);
    return lower;
}

// Tables of a grid: the rows' (height + 1 values), then one (width + 1 values) for each row.
uint distribution_row_base(uint base, uvec2 size, uint row) { return base + size.y + 1u + row * (size.x + 1u); }

// The cell that two words choose, which become the place within its share.
uvec2 distribution_sample_2d(uint base, uvec2 size, inout uvec2 word, uvec2 fresh, out float probability) {
    float p_row;
    float p_column;
    uint row = distribution_sample(base, size.y, word.y, fresh.y, p_row);
    uint column = distribution_sample(distribution_row_base(base, size, row), size.x, word.x, fresh.x, p_column);
    probability = p_row * p_column;
    return uvec2(column, row);
}

#endif
