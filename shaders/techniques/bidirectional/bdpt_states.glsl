// Path sets over paths made from both ends. Their automaton reads a path from the eye to the light: an eye subpath has a state, a light subpath all those states from which its
// scatterings lead to light that counts, a bit each. What is joined counts where the eye's state, after the scatterings at the joint, is one of the light's.
//
// Walks scatter by all lobes, whatever the set: densities and weights are those of all paths, and a path that cannot belong to the set any more ends. Notation: P. Heckbert, "Adaptive
// Radiosity Textures for Bidirectional Ray Tracing", 1990. Expects the constants of transport/features.glsl.
#ifndef CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_STATES_GLSL
#define CLERESTORY_TECHNIQUES_BIDIRECTIONAL_BDPT_STATES_GLSL

#include "techniques/bidirectional/bdpt_set.glsl"
#include "transport/path_set.glsl"
#include "transport/surface.glsl"

// Lobes at the eye's vertex of a joint, and those at the light's that may come before.
struct JointLobes {
    uint here;
    uint there;
};

uint accepting_states() { return HAS_PATH_AUTOMATON ? bdpt_states[PATH_SET_STATES] : 1u; }

bool state_accepts(uint state) { return !HAS_PATH_AUTOMATON || (accepting_states() >> state & 1u) != 0u; }

// After scattering by one lobe; PATH_SET_DEAD where no path of the set goes on so.
uint state_behind(uint state, uint lobe) { return HAS_PATH_AUTOMATON ? path_set_successor(bdpt_states[state], lobe) : 0u; }

// Lobes that lead from a state to one of `states`.
uint lobes_into(uint state, uint states) { return HAS_PATH_AUTOMATON ? path_set_lobes_to(bdpt_states[state], states) : PATH_SET_LOBES; }

// The states from which one of some lobes leads to one of `states`.
uint states_before(uint states, uint lobes) {
    if (!HAS_PATH_AUTOMATON) {
        return 1u;
    }
    uint before = 0u;
    for (uint state = 0u; state < PATH_SET_STATES; ++state) {
        before |= (path_set_lobes_to(bdpt_states[state], states) & lobes) != 0u ? 1u << state : 0u;
    }
    return before;
}

// Of a class of lobes of a surface, LOBE_DIFFUSE or LOBE_GLOSSY, or in a medium, where `here` names the one; of path sets with an automaton.
JointLobes joint_lobes(uint state, uint here, uint states) {
    uint behind = state_behind(state, here);
    return JointLobes(here, behind == PATH_SET_DEAD ? 0u : lobes_into(behind, states));
}

#endif
