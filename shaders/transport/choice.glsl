// Choices that use up a part of a random number and give back the rest as a random number: points that are evenly spread over the unit
// square are so within each alternative, too.
//
// Twin: transport/choice.rs.
#ifndef CLERESTORY_TRANSPORT_CHOICE_GLSL
#define CLERESTORY_TRANSPORT_CHOICE_GLSL

// The largest number below one.
const float BELOW_ONE = 0.99999994;

// True with probability p, by u in [0, 1), which is evenly spread again afterwards. Of the 24 bits of u an alternative of probability q
// leaves 24 + log2(q).
bool choose_first(inout float u, float p) {
    bool first = u < p;
    u = min(first ? u / p : (u - p) / (1.0 - p), BELOW_ONE);
    return first;
}

#endif
