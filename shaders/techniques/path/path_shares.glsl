// How many samples each pixel of a band gets in a round: pixels have shares of the round's places, one behind the other. Twin of techniques/path/adaptive/shares.rs.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_SHARES_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_SHARES_GLSL

// descriptor set 2: PathShareSet

struct PathShare {
    uint first_place;   // it ends where that of the next pixel begins
    uint first_sample;  // of the pixel: those before were taken in other rounds
};

// By pixel of the band, and one behind the last.
layout(set = 2, binding = 0, scalar) restrict readonly buffer PathShares { PathShare path_shares[]; };

// Steps of a bisection of 2^32 pixels.
const uint SHARE_STEPS = 32u;

// The pixel that a place belongs to, one of `pixels` from `first` on whose shares hold it.
uint share_at(uint place, uint first, uint pixels) {
    for (uint step = 0u; step < SHARE_STEPS && pixels > 1u; ++step) {
        uint lower = pixels / 2u;
        bool above = path_shares[first + lower].first_place <= place;
        first += above ? lower : 0u;
        pixels = above ? pixels - lower : lower;
    }
    return first;
}

#endif
