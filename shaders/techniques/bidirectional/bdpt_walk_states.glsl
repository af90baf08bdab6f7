// Where walks carry what bdpt_states.glsl tells apart.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_WALK_STATES_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_WALK_STATES_GLSL

#include "techniques/bidirectional/bdpt_states.glsl"
#include "walk/wave.glsl"

// Takes the state of an eye path out of the word of its number of scatterings.
uint take_path_state(inout WalkState path) {
    if (!HAS_PATH_AUTOMATON) {
        return 0u;
    }
    uint state = path_set_state(path.bounce);
    path.bounce = path_set_bounce(path.bounce);
    return state;
}

// And puts it there.
void put_path_state(inout WalkState path, uint state) {
    if (HAS_PATH_AUTOMATON) {
        path.bounce = path_set_joined(path.bounce, state);
    }
}

// The states of a light subpath, which has no use for a scale of radiance; before it is scattered those in which light counts.
uint walk_states(WalkState walk) { return HAS_PATH_AUTOMATON ? uint(walk.eta_scale) : 1u; }
float states_of_walk(uint states) { return HAS_PATH_AUTOMATON ? float(states) : 1.0; }

#endif
