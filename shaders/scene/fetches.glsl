// Counts the texels that a kernel fetches, where it is specialized to: includers define CLERESTORY_COUNT_FETCHES as a bool constant; without one nothing is
// counted or compiled in.
//
// Counted is what the specialized kernel needs: of a record the quarters that the scene's features read, a texel that is read twice once. Nodes and triangles of the ray
// index are not: `clerestory index --peers` counts those.
#ifndef CLERESTORY_SCENE_FETCHES_GLSL
#define CLERESTORY_SCENE_FETCHES_GLSL

#ifndef CLERESTORY_COUNT_FETCHES
#define CLERESTORY_COUNT_FETCHES false
#endif

// Words of a quarter.
const uint QUARTER_WORDS = 4u;

uint fetched_texels = 0u;
uint fetched_words = 0u;

void count_fetches(uint texels, uint words) {
    if (CLERESTORY_COUNT_FETCHES) {
        fetched_texels += texels;
        fetched_words += words;
    }
}

void count_quarters(uint quarters) { count_fetches(quarters, QUARTER_WORDS * quarters); }

#endif
