// Words that bdpt_medium_camera.comp is told more than one thing by.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_CAMERA_WORDS_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_CAMERA_WORDS_GLSL

// Beside the first vertex of a dispatch: it goes on with those that have stopped.
const uint SPLATS_GO_ON = 0x80000000u;
// Where the greatest number of scatterings stands beside the least, and what stands there for no bound.
const uint BOUNCES_MOST_SHIFT = 16u;
const uint BOUNCES_UNBOUNDED = 0xFFFFu;

#endif
