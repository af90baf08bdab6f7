// The first sixteen dimensions of Sobol's sequence, as eight pairs.
//
// Direction numbers of Joe and Kuo, "Constructing Sobol Sequences with Better Two-Dimensional Projections" (SIAM J. Sci. Comput. 30, 2008), as far as
// the first 2^16 points need them. They are operands of instructions, not a table in memory: on software devices loads cost and arithmetic does not.
#ifndef CLERESTORY_TRANSPORT_SOBOL_GLSL
#define CLERESTORY_TRANSPORT_SOBOL_GLSL

const uint SOBOL_PAIRS = 8u;
const uint SOBOL_INDEX_BITS = 16u;

// Product of a matrix of direction numbers, the upper halves of two in a word, by the bits of an index mod 2: a fixed-point fraction.
uint sobol_product(uint index, uvec4 low, uvec4 high) {
    uvec4 even = uvec4(index, index >> 2u, index >> 4u, index >> 6u) & 1u;
    uvec4 odd = uvec4(index >> 1u, index >> 3u, index >> 5u, index >> 7u) & 1u;
    uvec4 x = (-even & (low << 16u)) ^ (-odd & (low & 0xffff0000u));
    even = uvec4(index >> 8u, index >> 10u, index >> 12u, index >> 14u) & 1u;
    odd = uvec4(index >> 9u, index >> 11u, index >> 13u, index >> 15u) & 1u;
    x ^= (-even & (high << 16u)) ^ (-odd & (high & 0xffff0000u));
    return x.x ^ x.y ^ x.z ^ x.w;
}

// Both coordinates of a point in a pair of dimensions below SOBOL_PAIRS; of the index its lower SOBOL_INDEX_BITS bits.
uvec2 sobol_pair(uint index, uint pair) {
    switch (pair) {
    case 0u:
        return uvec2(
            sobol_product(index, uvec4(0x40008000u, 0x10002000u, 0x04000800u, 0x01000200u),
                          uvec4(0x00400080u, 0x00100020u, 0x00040008u, 0x00010002u)),
            sobol_product(index, uvec4(0xc0008000u, 0xf000a000u, 0xcc008800u, 0xff00aa00u),
                          uvec4(0xc0c08080u, 0xf0f0a0a0u, 0xcccc8888u, 0xffffaaaau)));
    case 1u:
        return uvec2(
            sobol_product(index, uvec4(0xc0008000u, 0x90006000u, 0x5c00e800u, 0xc5008e00u),
                          uvec4(0x9cc06880u, 0x5590ee60u, 0xc09c8068u, 0x905560eeu)),
            sobol_product(index, uvec4(0xc0008000u, 0x50002000u, 0x7400f800u, 0x9300a200u),
                          uvec4(0x2540d880u, 0xe6d059e0u, 0xb40c7808u, 0xc3058202u)));
    case 2u:
        return uvec2(
            sobol_product(index, uvec4(0x40008000u, 0xb0002000u, 0xdc00f800u, 0x9d007a00u),
                          uvec4(0x2fc05a80u, 0xf0b0a160u, 0x6fc4da88u, 0x40bb8162u)),
            sobol_product(index, uvec4(0x40008000u, 0x30006000u, 0x2400c800u, 0xfb005600u),
                          uvec4(0x7040e080u, 0x1430a860u, 0xdf249ec8u, 0x8bbbb6d6u)));
    case 3u:
        return uvec2(
            sobol_product(index, uvec4(0xc0008000u, 0xd000a000u, 0x94005800u, 0xe3003e00u),
                          uvec4(0x23c0be80u, 0xf3101e20u, 0x67844678u, 0x84677846u)),
            sobol_product(index, uvec4(0x40008000u, 0x5000a000u, 0x24008800u, 0x2d001200u),
                          uvec4(0x9e407680u, 0x64100820u, 0x7d14b228u, 0xba49fea2u)));
    case 4u:
        return uvec2(
            sobol_product(index, uvec4(0x40008000u, 0x5000a000u, 0xd4002800u, 0x71006a00u),
                          uvec4(0x58403880u, 0x3110ea20u, 0x085498a8u, 0xe525c22au)),
            sobol_product(index, uvec4(0x40008000u, 0xb000e000u, 0x94009800u, 0x5b008a00u),
                          uvec4(0xd9c03380u, 0x3f107220u, 0xa6ecc1b8u, 0x29f55386u)));
    case 5u:
        return uvec2(
            sobol_product(index, uvec4(0x40008000u, 0x1000a000u, 0x6c000800u, 0x23009e00u),
                          uvec4(0xadc05780u, 0x91d07fa0u, 0xced44988u, 0x2c0f880au)),
            sobol_product(index, uvec4(0x40008000u, 0x30002000u, 0xac005800u, 0x2b009600u),
                          uvec4(0x0940d480u, 0x5250e2a0u, 0xc71c4e28u, 0x1267629eu)));
    case 6u:
        return uvec2(
            sobol_product(index, uvec4(0xc0008000u, 0x5000a000u, 0x8c00f800u, 0x3300e200u),
                          uvec4(0x21400f80u, 0x5e7095a0u, 0x1c24d808u, 0xef37ba16u)),
            sobol_product(index, uvec4(0xc0008000u, 0x90006000u, 0xc4003800u, 0xa3004200u),
                          uvec4(0xaa40f180u, 0x8510fce0u, 0x500ce008u, 0x54095806u)));
    default:
        return uvec2(
            sobol_product(index, uvec4(0x40008000u, 0xf0002000u, 0x5400a800u, 0x9d009a00u),
                          uvec4(0x5cc01e80u, 0x8d107d20u, 0x71c42488u, 0x75dfeba2u)),
            sobol_product(index, uvec4(0xc0008000u, 0xd0002000u, 0xc400d800u, 0x85004600u),
                          uvec4(0x76c0a580u, 0x6ab0ada0u, 0xaabc2da8u, 0x7ab10daau)));
    }
}

#endif
