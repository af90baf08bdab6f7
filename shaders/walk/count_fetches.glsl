// For stages of a wave that can count what they fetch (scene/fetches.glsl); to be included before anything that fetches.
#ifndef CLERESTORY_WALK_COUNT_FETCHES_GLSL
#define CLERESTORY_WALK_COUNT_FETCHES_GLSL

layout(constant_id = 36) const bool COUNT_FETCHES = false;  // for measuring
#define CLERESTORY_COUNT_FETCHES COUNT_FETCHES

#endif
