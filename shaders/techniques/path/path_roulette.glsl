// Russian roulette of eye paths. Expects: a push-constant block `push` with `roulette_start`, the first bounce at which it may end a path, and `roulette_cap`, the
// largest probability to go on.
#ifndef CLERESTORY_TECHNIQUES_PATH_PATH_ROULETTE_GLSL
#define CLERESTORY_TECHNIQUES_PATH_PATH_ROULETTE_GLSL

#include "walk/wave.glsl"

// Whether a path that has been scattered goes on, by a number in [0, 1); weights it if it does.
bool path_roulette(inout WalkState path, float u) {
    if (path.bounce < push.roulette_start) {
        return true;
    }
    vec3 t = path.throughput * path.eta_scale;
    float survival = min(max(t.x, max(t.y, t.z)), push.roulette_cap);
    // Also ends a path whose throughput is not a number.
    if (!(u < survival)) {
        return false;
    }
    path.throughput /= survival;
    return true;
}

#endif
