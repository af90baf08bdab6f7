// What fresnel_curve.comp evaluates, and from what.
#ifndef CLERESTORY_TRANSPORT_FRESNEL_CURVE_GLSL
#define CLERESTORY_TRANSPORT_FRESNEL_CURVE_GLSL

const uint CURVE_NOTHING = 0u;            // the cosine, for the cost of a chain itself
const uint CURVE_EXACT = 1u;
const uint CURVE_SCHLICK = 2u;            // from eta
const uint CURVE_RESCALED = 3u;           // from eta and k
const uint CURVE_COMPENSATED = 4u;        // from eta, k, a and alpha
const uint CURVE_RESCALED_F0 = 5u;        // from the normal reflectance
const uint CURVE_COMPENSATED_F0 = 6u;     // from it, a and alpha
const uint CURVE_TINTED = 7u;             // from it and a
const uint CURVE_SIMPLIFIED = 8u;         // from eta and k
const uint CURVE_TABLE = 9u;              // times the simplified geometric term
const uint CURVE_ARTISTIC = 10u;          // the simplified one from the normal reflectance, and an edge tint in a

#endif
