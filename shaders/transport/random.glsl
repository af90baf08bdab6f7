// Counter-based random numbers: nothing is stored between draws but the four words of `Sampler`.
//
// Method: PCG hashes of Jarzynski and Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020); shuffled and Owen-scrambled
// Sobol' (0,2)-sequence padded by slots of two dimensions, Burley, "Practical Hash-based Owen Scrambling" (JCGT 10(4), 2020),
// with the hash constants of Vegdahl (2021). Jointly stratified, the first slots of a stream are pairs of one sequence of sixteen dimensions.
// Guarantees: a draw is a pure function of (seed, pixel, sample_index, dimension); values lie on the 2^-24 grid of [0, 1).
// Expects: `CLERESTORY_SAMPLER`, a uint constant (specialization constant or macro), declared before the inclusion.
#ifndef CLERESTORY_TRANSPORT_RANDOM_GLSL
#define CLERESTORY_TRANSPORT_RANDOM_GLSL

#include "transport/sobol.glsl"

const uint SAMPLER_SOBOL = 0u;
const uint SAMPLER_PCG = 1u;
const uint SAMPLER_JOINT_SOBOL = 2u;
// Stands for the sample index in the key of a scrambled sequence, which is the same for all samples of a pixel.
const uint SEQUENCE_KEY = 0x9e3779b9u;
// Stands for the slot in the key by which the points of a joint sequence are shuffled, which is the same for all slots.
const uint JOINT_KEY = 0x85ebca6bu;
const float UNIT_PER_BITS24 = 1.0 / 16777216.0;

// One stream of random numbers. `dimension` counts slots: each call of sample_1d or sample_2d uses one.
struct Sampler {
    uint pixel;
    uint sample_index;
    uint dimension;
    uint seed;
};

uvec3 pcg3d(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> 16u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The upper 24 bits as a float in [0, 1).
float unit_float(uint bits) { return float(bits >> 8u) * UNIT_PER_BITS24; }

// Owen scrambling of a bit-reversed word: each bit changes by a function of the bits below it only.
uint owen_hash_reversed(uint x, uint seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

// Owen scrambling of a fixed-point fraction (most significant bit first).
uint owen_scramble(uint x, uint seed) { return bitfieldReverse(owen_hash_reversed(bitfieldReverse(x), seed)); }

// The second Sobol' dimension before its bit reversal: multiplication by the Pascal matrix mod 2, which is the shift x -> x + 1 of
// the polynomial over GF(2) whose coefficients are the bits; done by halves because (x + 1)^(2^k) = x^(2^k) + 1.
uint sobol_pascal(uint index) {
    index ^= index >> 16u;
    index ^= (index & 0xff00ff00u) >> 8u;
    index ^= (index & 0xf0f0f0f0u) >> 4u;
    index ^= (index & 0xccccccccu) >> 2u;
    index ^= (index & 0xaaaaaaaau) >> 1u;
    return index;
}

// The two random words of one of the first SOBOL_PAIRS slots of a joint sequence. Runs of 2^SOBOL_INDEX_BITS samples are scrambled each by itself.
uvec2 joint_sobol_bits(Sampler s) {
    uint run = SEQUENCE_KEY + (s.sample_index >> SOBOL_INDEX_BITS);
    uint index = owen_scramble(s.sample_index, pcg4d(uvec4(s.pixel, run, JOINT_KEY, s.seed)).x);
    uvec4 key = pcg4d(uvec4(s.pixel, run, s.dimension, s.seed));
    uvec2 point = sobol_pair(index, s.dimension);
    return uvec2(owen_scramble(point.x, key.y), owen_scramble(point.y, key.z));
}

// The two random words of a slot.
uvec2 sampler_bits(Sampler s) {
    if (CLERESTORY_SAMPLER == SAMPLER_JOINT_SOBOL && s.dimension < SOBOL_PAIRS) {
        return joint_sobol_bits(s);
    }
    const bool sobol = CLERESTORY_SAMPLER != SAMPLER_PCG;
    uvec4 key = pcg4d(uvec4(s.pixel, sobol ? SEQUENCE_KEY : s.sample_index, s.dimension, s.seed));
    if (!sobol) {
        return key.xy;
    }
    uint index = owen_scramble(s.sample_index, key.x);
    return uvec2(bitfieldReverse(owen_hash_reversed(index, key.y)),
                 bitfieldReverse(owen_hash_reversed(sobol_pascal(index), key.z)));
}

float sample_1d(inout Sampler s) {
    uint bits = sampler_bits(s).x;
    s.dimension += 1u;
    return unit_float(bits);
}

vec2 sample_2d(inout Sampler s) {
    uvec2 bits = sampler_bits(s);
    s.dimension += 1u;
    return vec2(unit_float(bits.x), unit_float(bits.y));
}

#endif
