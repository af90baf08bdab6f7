// Places of a split picture: what is seen there, and how far its lights have been taken.
#ifndef CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SPLIT_PLACE_GLSL
#define CLERESTORY_TECHNIQUES_INSTANT_RADIOSITY_SPLIT_PLACE_GLSL

// The nearest surface of a pixel.
struct SplitPlace {
    uint triangle;  // NO_HIT for none
    vec2 weights;   // of its corners 1 and 2
};

// What a place has had of the lights, where it goes on.
struct GatherState {
    vec3 sum;
    uint light;   // the next one
    uint cursor;  // where its shadow ray goes on
};

#endif
