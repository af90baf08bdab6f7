// What eye paths find by themselves, as the strategies that there are have it. Expects a push-constant block `push` with the range of bounces, and the constants of
// transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_STRATEGY_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_STRATEGY_GLSL

#include "techniques/bidirectional/bdpt_set.glsl"

const bool HAS_LIGHTS = HAS_AREA_LIGHTS || HAS_ENVIRONMENT || HAS_PUNCTUAL_LIGHTS;

bool counts(uint bounces) { return bounces >= push.least_bounces && bounces <= push.most_bounces; }

// Weight of what one strategy has found, whose other ways weigh so much.
float strategy_weight(uint strategy, float to_light, float to_eye) {
    return STRATEGY == STRATEGY_COMBINED ? mis_weight(to_light, to_eye) : (STRATEGY == strategy ? 1.0 : 0.0);
}

#endif
