// The lobe of prefiltered reflections. Sources and guarantees: maps/prefilter.rs.
#ifndef CLERESTORY_MAPS_GGX_LOBE_GLSL
#define CLERESTORY_MAPS_GGX_LOBE_GLSL

// Texels of the filtered map that an invocation makes, so that what it reads of the source serves all of them: the columns of a mat4.
const uint PREFILTER_TEXELS_PER_INVOCATION = 4u;

// Between unit directions: where the mirror looks, and from where light comes. Not normalised; at most 1.
float ggx_lobe(vec3 r, vec3 d, float alpha) {
    vec3 apart = r - d;
    // 1 - (n . h)^2, without the cancellation of 1 - r . d.
    float sine = 0.25 * dot(apart, apart);
    float a = alpha * alpha;
    float shape = a / (a + (1.0 - a) * sine);
    return max(1.0 - 2.0 * sine, 0.0) * shape * shape;
}

#endif
