#version 460
// Radix sort, third stage of a digit: each invocation walks its block in order and writes every key to the next place of its digit.
//
// On processors the writes of an invocation wait for memory one after the other, since each digit goes to a cache line of its own. Where
// the stream passes the caches, the lines that the next keys will go to are therefore read beforehand, all digits in a row, so that many
// are on their way at once (software prefetching as in Callahan, Kennedy and Porterfield, Software prefetching, 1991).
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x_id = 0) in;

#include "kernels/radix_serial.glsl"

layout(constant_id = 4) const bool READS_AHEAD = false;

// Words of a cache line, as processors have them.
const uint LINE_WORDS = 16u;
// Keys of an average digit between two reads ahead, which reach twice as far: a line.
const uint KEYS_PER_DIGIT = LINE_WORDS / KEY_WORDS;

uint places[BINS];

uint keys_ahead(uint word, uint count) { return radix_keys_out[min(word, KEY_WORDS * count - 1u)]; }

uint values_ahead(uint word, uint count) { return radix_values_out[min(word, count - 1u)]; }

// Reads from the lines that the next keys of every digit go to. What is read may be anything. Without loops over lines, since software
// drivers bound the iterations of all loops together.
uint read_ahead(uint count) {
    uint any = 0u;
    for (uint digit = 0u; digit < BINS; ++digit) {
        uint place = places[digit];
        uint word = KEY_WORDS * place + LINE_WORDS - 1u;
        any |= keys_ahead(word, count) | keys_ahead(word + LINE_WORDS, count);
        if (HAS_VALUES) {
            word = place + LINE_WORDS - 1u;
            any |= values_ahead(word, count) | values_ahead(word + LINE_WORDS, count);
        }
    }
    return any;
}

void place(uint low, uint high, uint value) {
    uint digit = radix_digit(low, high);
    uint target = places[digit];
    places[digit] = target + 1u;
    radix_keys_out[KEY_WORDS * target] = low;
    if (KEY_WORDS == 2u) {
        radix_keys_out[2u * target + 1u] = high;
    }
    if (HAS_VALUES) {
        radix_values_out[target] = value;
    }
}

uvec4 load_values(uint first) {
    return HAS_VALUES ? texelFetch(radix_values_in, int(first / 4u)) : uvec4(0u);
}

void main() {
    uint team = gl_GlobalInvocationID.x;
    uint count = stream_size(push.plan);
    uint block = stream_block(count, push.plan.tile, push.plan.max_teams);
    if (team >= stream_teams(count, block)) {
        return;
    }
    uint before = 0u;
    for (uint digit = 0u; digit < BINS; ++digit) {
        places[digit] = before + scratch[count_at(digit, team)];
        before += scratch[total_at(digit)];
    }
    uvec2 range = stream_range(team, count, block);
    uvec4 low, high;
    uint any = 0u;
    uint first = range.x;
    while (first + KEYS_PER_READ <= range.y) {
        uint last = range.y;
        if (READS_AHEAD) {
            any |= read_ahead(count);
            last = min(last, first + KEYS_PER_DIGIT * BINS);
        }
        for (; first + KEYS_PER_READ <= last; first += KEYS_PER_READ) {
            load_keys(first, range.y, low, high);
            uvec4 values = load_values(first);
            place(low.x, high.x, values.x);
            place(low.y, high.y, values.y);
            place(low.z, high.z, values.z);
            place(low.w, high.w, values.w);
        }
    }
    if (first < range.y) {
        load_keys(first, range.y, low, high);
        uvec4 values = load_values(first);
        for (uint i = 0u; first + i < range.y; ++i) {
            place(low[i], high[i], values[i]);
        }
    }
    // Never so, since flips are parts of masks; but compilers do not know, and must read.
    if (READS_AHEAD && (any & push.flip & ~push.mask) != 0u) {
        scratch[0] = any;
    }
}
