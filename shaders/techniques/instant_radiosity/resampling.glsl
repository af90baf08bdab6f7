// Resampled importance sampling: of candidates one is kept by what it would bring, and stands for them all. Twin of resampling.rs.
//
// J. Talbot, D. Cline and P. Egbert, "Importance Resampling for Global Illumination", 2005.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RESAMPLING_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_RESAMPLING_GLSL

// Adds the weight of a candidate to the sum, and says whether it is kept in the place of those before, by a number `u` in [0, 1).
bool resample(float u, float weight, inout float sum) {
    sum += weight;
    return u * sum < weight;
}

#endif
